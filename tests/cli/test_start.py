"""What a user may start a training from, and what is said where that does not work."""

from collections.abc import Callable
from pathlib import Path

import lightning
import numpy as np
import pytest
import torch

from derain.cards.card import load_card
from derain.default import packaged_model
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.runtime import Derainer
from derain.learning.start import STARTED_FROM
from derain.models.checkpoint import load_model, save_model
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.workflows.start import checkpoint_of


def trained(path: Path, neighbours: int = 4, seed: int = 0) -> OutDet:
    """A blind network, as far as a checkpoint is concerned."""
    lightning.seed_everything(seed)
    model = OutDet(neighbours=neighbours, channels=("range",))
    model.adopt(model.spec_for(load_card("wads")))
    save_model(model, path)
    return model


@pytest.fixture
def exported(run_derain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """A checkpoint and its ONNX file side by side, which have one name."""
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])
    trained(tmp_path / "model.ckpt")
    path = tmp_path / "model.onnx"
    outcome = run_derain("export", tmp_path / "model.ckpt", "--out", path, "--repeats", "1")
    assert outcome.code == 0, outcome.err
    return path


@pytest.mark.usefixtures("one_block")
def test_an_onnx_file_stands_for_the_checkpoint_beside_it(exported: Path) -> None:
    checkpoint = exported.with_suffix(".ckpt")
    assert checkpoint_of(str(checkpoint)) == checkpoint_of(str(exported)) == checkpoint
    trained(checkpoint, neighbours=5)
    with pytest.raises(InputError, match=r"not the checkpoint of model\.onnx: they differ in view"):
        checkpoint_of(str(exported))
    checkpoint.unlink()
    with pytest.raises(InputError, match=r"weights are folded, and model\.ckpt is not beside it"):
        checkpoint_of(str(exported))
    with pytest.raises(InputError, match="no such file"):
        checkpoint_of(str(checkpoint))


def test_default_is_the_checkpoint_that_derain_comes_with(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(packaged_model, "_folder", lambda: tmp_path)
    with pytest.raises(InputError, match=r"comes with derain is missing\. Install derain again"):
        checkpoint_of("default")
    trained(tmp_path / "model.ckpt")
    assert checkpoint_of("default") == tmp_path / "model.ckpt"


def test_fit_begins_with_the_weights_of_its_start(
    succeed, tmp_path: Path, wads: list[str], monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    source = trained(tmp_path / "start.ckpt")
    # At a rate of nothing, it ends where it began.
    still = ("--model.learning_rate", "0", "--model.weight_decay", "0", "--trainer.max_epochs", "1")
    succeed("fit", *wads, "--start", "start.ckpt", *still, "--panels.scans", "1")
    run = Path("runs/outdet_wads/version_0")
    student = load_model(run / "checkpoints/last.ckpt")
    for name, parameter in source.named_parameters():
        torch.testing.assert_close(student.get_parameter(name), parameter, rtol=0, atol=0)
    (name,) = student.spec.training[STARTED_FROM]
    assert name.startswith("start.ckpt (")
    assert student.hparams["learning_rate"] == 0
    assert "start: start.ckpt" in (run / "config.yaml").read_text()
    # A training goes on from its checkpoints as from any other.
    last = ("--ckpt_path", run / "checkpoints/last.ckpt")
    more = ("--start", "start.ckpt", *still[:-1], "2")
    succeed("fit", *wads, *more, *last)


def test_fit_tells_what_it_cannot_start_from(run_derain, tmp_path: Path, wads: list[str]) -> None:
    start = tmp_path / "start.ckpt"
    trained(start)
    options = [*wads, "--start", str(start)]
    options[options.index("outdet_wads.yaml")] = "salsanext_wads.yaml"
    outcome = run_derain("fit", *options)
    assert outcome.code == 2
    assert "of outdet, from which salsanext cannot start" in outcome.err.splitlines()[-1]


@pytest.fixture
def recording(tmp_path: Path) -> Callable[[int], Path]:
    """Writes five scans of 600 points, a tenth of them drops, of three columns or four."""

    def write(columns: int) -> Path:
        folder = tmp_path / "drive/velodyne"
        folder.mkdir(parents=True)
        for number in range(5):
            np.ascontiguousarray(scene(600, number)[:, :columns]).tofile(folder / f"{number}.bin")
        return folder

    return write


@pytest.mark.usefixtures("one_block")
def test_learn_takes_over_what_its_start_sees_and_says_so(
    succeed, tmp_path: Path, recording, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])
    trained(Path("mine.ckpt"))
    command = ("learn", recording(4), "--out", "student.onnx", "--teacher", "dror")
    succeed(*command, "--epochs", "1", "--start", "mine.ckpt")
    spec = Derainer("student.onnx").spec
    assert spec.channels == ("range",)
    assert spec.view["neighbours"] == 4
    assert spec.training[STARTED_FROM][0].startswith("mine.ckpt (")
    assert "taught by dror" in spec.data
    report = Path("student_learning/report.md").read_text()
    assert "## The student: outdet, blind to intensity, started from mine.ckpt" in report
    assert "--start mine.ckpt" in report


@pytest.mark.parametrize(
    ("channels", "columns", "options", "says"),
    [
        (("x", "intensity"), 3, (), "has no intensities, which mine.ckpt sees"),
        (("x", "intensity"), 4, ("--blind",), "mine.ckpt sees intensity"),
        (("range",), 4, ("--model", "salsanext"), "mine.ckpt is of outdet, from which salsanext"),
        (("range",), 4, ("--work", "."), "mine.ckpt: lies in ., which this run clears first"),
    ],
)
def test_learn_tells_what_does_not_go_with_its_start(
    run_derain,
    tmp_path: Path,
    recording,
    monkeypatch: pytest.MonkeyPatch,
    channels: tuple[str, ...],
    columns: int,
    options: tuple[str, ...],
    says: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    model = OutDet(neighbours=4, channels=channels)
    model.adopt(model.spec_for(load_card("wads")))
    save_model(model, Path("mine.ckpt"))
    names = ("--columns", "x,y,z,intensity"[: 5 if columns == 3 else None])
    command = ("learn", recording(columns), "--out", "student.onnx", *names, *options)
    outcome = run_derain(*command, "--start", "mine.ckpt")
    assert outcome.code == 2
    assert says in outcome.err
    assert not Path("student.onnx").exists()
