"""``derain import-weights`` makes a checkpoint of published weights, and of nothing else."""

import pickle
from pathlib import Path

import pytest
import torch
from torch import Tensor

from derain.cards import load_card
from derain.models.checkpoint import load_model
from derain.models.outdet import PUBLISHED_KEYS, OutDet


@pytest.fixture(scope="module")
def published(random_outdet: OutDet) -> dict[str, Tensor]:
    """The random network's weights under the published names."""
    tensors = random_outdet.network.state_dict()
    return {published: tensors[ours] for ours, published in PUBLISHED_KEYS.items()}


@pytest.mark.parametrize("stats", ["wads", "kitti", "spray"])
@pytest.mark.parametrize("prefix", ["", "module."])
def test_the_checkpoint_computes_what_the_weights_do(
    run_derain,
    published: dict[str, Tensor],
    random_outdet: OutDet,
    tmp_path: Path,
    prefix: str,
    stats: str,
) -> None:
    weights, out = tmp_path / "published.pt", tmp_path / "outdet.ckpt"
    torch.save({f"{prefix}{key}": tensor for key, tensor in published.items()}, weights)
    outcome = run_derain("import-weights", "outdet", weights, "--stats", stats, "--out", out)
    assert (outcome.code, outcome.err) == (0, "")
    assert str(out) in outcome.out
    model = load_model(out)
    card = load_card(stats)
    assert (model.spec.mean, model.spec.std, model.spec.data) == (card.mean, card.std, card.name)
    for name, tensor in random_outdet.network.state_dict().items():
        torch.testing.assert_close(model.network.state_dict()[name], tensor, rtol=0, atol=0)


def test_a_training_checkpoint_that_holds_the_weights_will_do(
    run_derain, published: dict[str, Tensor], tmp_path: Path
) -> None:
    weights, out = tmp_path / "published.pt", tmp_path / "outdet.ckpt"
    torch.save({"epoch": 3, "state_dict": published}, weights)
    outcome = run_derain("import-weights", "outdet", weights, "--stats", "wads", "--out", out)
    assert outcome.code == 0
    assert load_model(out).spec.data == "WADS"


class Trojan:
    """Runs code when it is unpickled by a careless reader."""

    def __init__(self, trace: Path) -> None:
        self.trace = trace

    def __reduce__(self) -> tuple[object, tuple[Path]]:
        return Path.touch, (self.trace,)


def test_weights_that_run_code_are_refused(run_derain, tmp_path: Path) -> None:
    weights, trace = tmp_path / "trojan.pt", tmp_path / "trace"
    torch.save({"state_dict": Trojan(trace)}, weights)
    out = tmp_path / "out.ckpt"
    outcome = run_derain("import-weights", "outdet", weights, "--stats", "wads", "--out", out)
    assert outcome.code == 2
    assert len(outcome.err.splitlines()) == 1
    assert not trace.exists()
    assert not out.exists()
    pickle.loads(pickle.dumps(Trojan(trace)))  # so the trap does work
    assert trace.exists()


@pytest.mark.parametrize(
    ("network", "weights", "stats", "reason"),
    [
        ("resnet", "published.pt", "wads", "resnet: no such network. Known are outdet"),
        ("outdet", "none.pt", "wads", "none.pt: no such file"),
        ("outdet", "published.pt", "mars", "mars: no such data card. Give a YAML file or one of"),
        ("outdet", "published.pt", "rehearse3d", "the data card has no statistics"),
        ("outdet", "other.pt", "wads", "the state_dict is of another network (1 keys missing"),
        ("outdet", "list.pt", "wads", "list.pt: holds a list"),
        ("outdet", "text.pt", "wads", "text.pt: damaged"),
    ],
)
def test_what_cannot_be_imported_is_one_line_and_exit_code_2(
    run_derain,
    published: dict[str, Tensor],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    network: str,
    weights: str,
    stats: str,
    reason: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    torch.save(published, "published.pt")
    torch.save({key: tensor for key, tensor in published.items() if key != "fc.bias"}, "other.pt")
    torch.save([1, 2], "list.pt")
    Path("text.pt").write_text("weights")
    outcome = run_derain("import-weights", network, weights, "--stats", stats, "--out", "out.ckpt")
    assert (outcome.code, outcome.out) == (2, "")
    (line,) = outcome.err.splitlines()
    assert reason in line
    assert sorted(path.name for path in tmp_path.iterdir()) == [
        *("list.pt", "other.pt", "published.pt", "text.pt")
    ]


def test_an_output_that_cannot_be_written_is_reported(
    run_derain, published: dict[str, Tensor], tmp_path: Path
) -> None:
    weights = tmp_path / "published.pt"
    torch.save(published, weights)
    out = weights / "outdet.ckpt"
    outcome = run_derain("import-weights", "outdet", weights, "--stats", "wads", "--out", out)
    assert outcome.code == 2
    assert outcome.err.startswith(f"derain: {out}: cannot be written")
    assert list(tmp_path.iterdir()) == [weights]
