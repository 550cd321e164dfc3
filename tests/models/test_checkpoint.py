"""Checkpoints give back what was saved, and nothing that is not a checkpoint of derain."""

import io
import json
import pickle
import resource
import tempfile
from contextlib import suppress
from pathlib import Path
from typing import Any
from zipfile import ZIP_DEFLATED, ZipFile

import pytest
import torch

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.models.checkpoint import WholeCheckpoints, load_model, save_model
from derain.models.outdet import PUBLISHED_KEYS, OutDet, OutDetNetwork
from derain.models.published import read_state_dict
from derain.spec import SCHEMA

DAMAGED = "damaged, or holds more than tensors and plain values"


class Code:
    """Unpickled, creates a file."""

    def __init__(self, witness: Path) -> None:
        self.witness = witness

    def __reduce__(self) -> tuple[Any, ...]:
        return Path.touch, (self.witness,)


@pytest.fixture
def path(tmp_path) -> Path:
    return tmp_path / "model.ckpt"


@pytest.fixture
def content(outdet, path) -> dict[str, Any]:
    """What a checkpoint holds, in the file as well."""
    save_model(outdet(neighbours=5), path)
    return torch.load(path, weights_only=True)


def test_a_model_comes_back_as_it_was(outdet, sample, path) -> None:
    model = outdet(seed=1, neighbours=5)
    model.hparams.update(learning_rate=0.5, milestones=(1, 2), threshold=0.25)
    save_model(model, path)
    copy = load_model(path)
    assert isinstance(copy, OutDet)
    assert not copy.training
    assert copy.spec == model.spec
    assert dict(copy.hparams) == {k: v for k, v in model.hparams.items() if k != "_class_path"}
    batch = Batch.of([sample(model, scene(200))])
    assert torch.equal(copy(**batch.inputs), model(**batch.inputs))


def test_hyper_parameters_are_primitives_only(content) -> None:
    parameters = dict(content["hyper_parameters"])
    tuples = {name: parameters.pop(name) for name in ("channels", "milestones")}
    assert json.loads(json.dumps(parameters)) == parameters
    assert tuples == {"channels": ("x", "y", "z", "intensity"), "milestones": (30, 40, 45)}
    assert parameters["spec"]["view"] == {"kind": "neighbours", "neighbours": 5}


@pytest.mark.parametrize(
    "change",
    [
        {"hyper_parameters": None},
        {"hyper_parameters": {"learning_rate": 1e-3}},
        {"hyper_parameters": {"spec": None}},
        {"state_dict": None},
    ],
    ids=str,
)
def test_a_checkpoint_of_something_else_is_refused(content, path, change) -> None:
    changed = {key: value for key, value in {**content, **change}.items() if value is not None}
    torch.save(changed, path)
    with pytest.raises(InputError, match=r"model\.ckpt: not a checkpoint of derain"):
        load_model(path)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"network": "pointnet"}, "a checkpoint of 'pointnet',"),
        ({"schema": SCHEMA + 1}, "its Spec: schema: .*Upgrade derain"),
        ({"classes": None}, "its Spec: classes"),
        ({"mean": [1.0, 2.0, 3.0, "4"]}, "its Spec: mean"),
        ({"view": {"kind": "neighbours", "neighbours": 7}}, ".*its view is"),
        (
            {"view": {"kind": "range", "grid": "semantickitti", "way_back": "copy"}},
            ".*its view is",
        ),
        ({"rule": {"residual": 0.008}}, ".*rule: outdet has no rule with constants"),
    ],
    ids=str,
)
def test_a_spec_that_the_network_cannot_have_is_refused(content, path, change, reason) -> None:
    content["hyper_parameters"]["spec"] |= change
    torch.save(content, path)
    with pytest.raises(InputError, match=rf"model\.ckpt: {reason}"):
        load_model(path)


@pytest.mark.parametrize(
    "change",
    [
        *({"neighbours": wrong} for wrong in (-1, 0, 6, 10**7, 10**400, 5.5, "5", None)),
        *({"channels": wrong} for wrong in ((), ("x",) * 4, "xyzi", 4, None, ("x", "y", "z"))),
        {"threshold": 0.5, "neighbours": [5]},
        {"layers": 3},
    ],
    ids=str,
)
def test_hyper_parameters_that_cannot_be_take_no_memory(content, path, change) -> None:
    content["hyper_parameters"].update(change)
    torch.save(content, path)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match=r"model\.ckpt: "):
        load_model(path)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # KiB


@pytest.mark.parametrize(
    "bias",
    [
        None,
        torch.zeros(2, dtype=torch.int64),
        torch.zeros(3),
        torch.zeros(1).expand(2**40),
        [0.0, 0.0],
    ],
    ids=["missing", "integers", "another shape", "very many", "a list"],
)
def test_weights_that_do_not_fit_are_refused_in_one_line(content, path, bias) -> None:
    content["state_dict"]["network.head.bias"] = bias
    if bias is None:
        del content["state_dict"]["network.head.bias"]
    torch.save(content, path)
    with pytest.raises(InputError, match=r"model\.ckpt: its weights do not fit outdet") as refusal:
        load_model(path)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize("read", [load_model, read_state_dict])
def test_a_compressed_checkpoint_is_refused(content, path, read) -> None:
    parts = ZipFile(io.BytesIO(path.read_bytes()))
    with ZipFile(path, "w", ZIP_DEFLATED) as bomb:
        for name in parts.namelist():
            bomb.writestr(name, parts.read(name))
    assert torch.load(path, weights_only=True).keys() == content.keys()
    with pytest.raises(InputError, match=rf"model\.ckpt: {DAMAGED}"):
        read(path)


def test_published_weights_do_not_decide_how_much_memory_is_taken() -> None:
    tensors = {name: torch.zeros(1) for name in PUBLISHED_KEYS.values()}
    tensors["convs.0.conv1.dw"] = torch.zeros(1).expand(10**7)
    before = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss
    with pytest.raises(InputError, match="the state_dict is of another network"):
        OutDetNetwork.from_published(tensors)
    assert resource.getrusage(resource.RUSAGE_SELF).ru_maxrss - before < 200_000  # KiB


@pytest.mark.usefixtures("content")
def test_a_file_that_is_cut_short_or_of_something_else_is_refused(path) -> None:
    whole = path.read_bytes()
    short = [whole[: int(share * len(whole))] for share in (0.0, 0.001, 0.5, 0.9999)]
    for damaged in (*short, b"hello", b"\x80\x02.", bytes(1000)):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=rf"model\.ckpt: {DAMAGED}"):
            load_model(path)


def test_a_bare_pickle_is_refused_without_a_word_from_torch(path, recwarn) -> None:
    path.write_bytes(pickle.dumps({"a": 1}))
    with pytest.raises(InputError, match=rf"model\.ckpt: {DAMAGED}"):
        load_model(path)
    assert not recwarn.list


@pytest.mark.parametrize("writer", ["torch", "pickle"])
@pytest.mark.parametrize("read", [load_model, read_state_dict])
def test_code_in_a_file_does_not_run(content, tmp_path, path, writer, read) -> None:
    witness = tmp_path / "the code ran"
    content["callbacks"] = Code(witness)
    if writer == "torch":
        torch.save(content, path)
    else:
        path.write_bytes(pickle.dumps(Code(witness), protocol=2))
    with pytest.raises(InputError, match=rf"model\.ckpt: {DAMAGED}"):
        read(path)
    assert not witness.exists()
    # The file is what it is meant to be: torch would run the code if it were allowed to.
    with suppress(RuntimeError):
        torch.load(path, weights_only=False)
    assert witness.exists()


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ([torch.ones(2)], "holds a list"),
        ({"epoch": 3}, "not a state_dict of tensors"),
        ({"state_dict": [1, 2]}, "not a state_dict of tensors"),
        ({3: torch.ones(2)}, "not a state_dict of tensors"),
    ],
)
def test_what_is_no_state_dict_is_refused(path, content, reason) -> None:
    torch.save(content, path)
    with pytest.raises(InputError, match=rf"model\.ckpt: {reason}"):
        read_state_dict(path)


def test_a_run_does_not_start_from_a_checkpoint_of_something_else() -> None:
    for content in ({}, {"hyper_parameters": {"lr": 1}}):
        with pytest.raises(InputError, match="it has no Spec"):
            OutDet().on_load_checkpoint(content)


def test_nothing_is_written_outside_the_folder(outdet, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    save_model(outdet(), tmp_path / "runs" / "model.ckpt")
    assert list((tmp_path / "runs").iterdir()) == [tmp_path / "runs" / "model.ckpt"]
    load_model(tmp_path / "runs" / "model.ckpt")


def test_weights_that_are_not_finite_take_no_checkpoints_place(tmp_path) -> None:
    path = tmp_path / "best.ckpt"
    path.write_bytes(b"the last good one")
    with pytest.raises(InputError, match=r"best\.ckpt: the weights head are not finite"):
        WholeCheckpoints().save_checkpoint({"state_dict": {"head": torch.tensor(torch.inf)}}, path)
    assert path.read_bytes() == b"the last good one"


def test_a_checkpoint_at_an_address_is_not_trusted_either() -> None:
    checkpoints = WholeCheckpoints()
    checkpoints.save_checkpoint({"epoch": 3}, "memory://runs/model.ckpt")
    assert checkpoints.load_checkpoint("memory://runs/model.ckpt") == {"epoch": 3}
    checkpoints.save_checkpoint({"epoch": Path("3")}, "memory://runs/model.ckpt")
    with pytest.raises(InputError, match=r"memory://runs/model\.ckpt: .*more than tensors"):
        checkpoints.load_checkpoint("memory://runs/model.ckpt", weights_only=False)
