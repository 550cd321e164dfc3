"""``derain import-weights`` makes a checkpoint of published weights, and of nothing else."""

from pathlib import Path

import pytest
import torch
from torch import Tensor

from derain.cards.card import load_card
from derain.models.checkpoint import load_model
from derain.models.outdet import PUBLISHED_KEYS, OutDet
from derain.models.salsanext import SalsaNext
from derain.models.salsanext.network import PUBLISHED_KEYS as SALSANEXT_KEYS
from derain.views.spherical_grid import grid_of

pytestmark = pytest.mark.usefixtures("here")


@pytest.fixture
def published(here, random_outdet) -> dict[str, Tensor]:
    """The random network's weights under the published names, also in a file of their own."""
    tensors = random_outdet.network.state_dict()
    weights = {published: tensors[ours] for ours, published in PUBLISHED_KEYS.items()}
    torch.save(weights, "published.pt")
    return weights


def assert_same_weights(checkpoint: Path, model: OutDet | SalsaNext) -> None:
    imported = load_model(checkpoint).network.state_dict()
    for name, tensor in model.network.state_dict().items():
        assert torch.equal(imported[name], tensor), name


@pytest.mark.usefixtures("published")
def test_normalisation_and_identity_are_two_things(succeed, facts_of, random_outdet) -> None:
    out = Path("outdet.ckpt")
    options = ["--stats", "wads", "--data", "rehearse3d", "--out", out]
    outcome = succeed("import-weights", "outdet", "published.pt", *options)
    assert f"Wrote {out}: outdet trained on REHEARSE-3D, with the statistics of WADS" in outcome.out
    assert_same_weights(out, random_outdet)
    spec, wads, rehearse = facts_of(out)["spec"], load_card("wads"), load_card("rehearse3d")
    assert (spec["data"], spec["licence"]) == (rehearse.name, rehearse.licence)
    assert spec["classes"] == {str(id_): name for id_, name in rehearse.classes.items()}
    assert spec["rain"] == [3]
    moments = [*zip(spec["mean"], spec["std"], strict=True)]
    assert moments == [wads.statistics(name) for name in ("x", "y", "z", "intensity")]
    assert spec["training"] == {"sequences": list(rehearse.split["train"])}


def training_checkpoint(model: SalsaNext) -> dict[str, object]:
    """What SalsaNext's trainer saves, with the state of its optimiser and of its warm-up.

    Source: TiagoCortinhal/SalsaNext, trainer.py and warmupLR.py, whose state holds a CyclicLR.
    """
    weights = model.network.state_dict()
    optimizer = torch.optim.SGD(model.parameters(), lr=0.01, momentum=0.9)
    warm_up = torch.optim.lr_scheduler.CyclicLR(optimizer, 0, 0.01, 10, cycle_momentum=False)
    return {
        "epoch": 33,
        "state_dict": {f"module.{SALSANEXT_KEYS[name]}": weights[name] for name in weights},
        "optimizer": optimizer.state_dict(),
        "info": {"train_loss": 0.017, "best_val_iou": 0.94},
        "scheduler": {"initial_scheduler": warm_up, "last_epoch": 7, "finished": True},
    }


def test_a_checkpoint_as_salsanext_saves_it_comes_with_its_grid(succeed, random_salsanext) -> None:
    torch.save(training_checkpoint(random_salsanext), "valid_best")
    options = ["--stats", "kitti", "--grid", "rehearse3d", "--out", "model.ckpt"]
    succeed("import-weights", "salsanext", "valid_best", *options)
    assert_same_weights(Path("model.ckpt"), random_salsanext)
    spec = load_model(Path("model.ckpt")).spec
    assert spec.data == load_card("kitti").name
    assert spec.view["grid"] == grid_of("rehearse3d", "").as_dict()


@pytest.mark.parametrize(
    ("network", "weights", "options", "reason"),
    [
        ("resnet", "published.pt", ("wads",), "resnet: no such network. Available: lisnownet"),
        ("cues", "published.pt", ("wads",), "cues: no weights of it were published. Available: l"),
        ("outdet", "none.pt", ("wads",), "none.pt: there is no such file"),
        ("outdet", "published.pt", ("mars",), "mars: no such data card. Give a YAML file or one"),
        ("outdet", "published.pt", ("rehearse3d",), "REHEARSE-3D: the data card has no"),
        ("outdet", "published.pt", ("semantickitti",), "--data: SemanticKITTI has no rain"),
        ("outdet", "published.pt", ("wads", "--grid", "wads"), "--grid: outdet sees neighbours"),
        ("outdet", "other.pt", ("wads",), "other.pt: the state_dict is of another network (1"),
        ("salsanext", "published.pt", ("wads",), "the state_dict is of another network"),
        ("salsanext", "salsanext.pt", ("wads", "--grid", "semantickiti"), "Did you mean semant"),
    ],
)
def test_what_cannot_be_imported_is_one_line_and_exit_code_2(
    refused, published, random_salsanext, network, weights, options, reason
) -> None:
    torch.save(training_checkpoint(random_salsanext), "salsanext.pt")
    torch.save({key: tensor for key, tensor in published.items() if key != "fc.bias"}, "other.pt")
    line = refused("import-weights", network, weights, "--out", "out.ckpt", "--stats", *options)
    assert reason in line
    assert not Path("out.ckpt").exists()
