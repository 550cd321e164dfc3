"""``derain import-weights`` makes a checkpoint of published weights, and of nothing else."""

import json
from pathlib import Path

import pytest
import torch
from torch import Tensor

from derain.cards.card import load_card
from derain.models.base import DerainingModule
from derain.models.checkpoint import load_model
from derain.models.lisnownet.network import published_key
from derain.models.outdet import PUBLISHED_KEYS, OutDet
from derain.models.salsanext import SalsaNext
from derain.models.salsanext.network import PUBLISHED_KEYS as SALSANEXT_KEYS
from derain.views.spherical_grid import grid_of


@pytest.fixture(scope="module")
def published(random_outdet: OutDet) -> dict[str, Tensor]:
    """The random network's weights under the published names."""
    tensors = random_outdet.network.state_dict()
    return {published: tensors[ours] for ours, published in PUBLISHED_KEYS.items()}


@pytest.mark.parametrize(("prefix", "stats"), [("", "wads"), ("module.", "spray")])
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


def test_normalisation_and_identity_are_two_things(
    run_derain, published: dict[str, Tensor], tmp_path: Path
) -> None:
    weights, out = tmp_path / "published.pt", tmp_path / "outdet.ckpt"
    torch.save(published, weights)
    options = ["--stats", "wads", "--data", "rehearse3d", "--out", out]
    outcome = run_derain("import-weights", "outdet", weights, *options)
    assert (outcome.code, outcome.err) == (0, "")
    assert "trained on REHEARSE-3D, with the statistics of WADS" in outcome.out
    said = json.loads(run_derain("info", out, "--json").out)["spec"]
    wads, rehearse = load_card("wads"), load_card("rehearse3d")
    assert (said["data"], said["licence"]) == (rehearse.name, rehearse.licence)
    assert said["classes"] == {str(id_): name for id_, name in rehearse.classes.items()}
    assert said["rain"] == [3]
    assert (said["mean"], said["std"]) == (list(wads.mean), list(wads.std))
    assert said["training"] == {"sequences": list(rehearse.split["train"])}


def test_weights_that_know_rain_were_not_trained_on_clean_data(
    refused, published: dict[str, Tensor], tmp_path: Path
) -> None:
    weights, out = tmp_path / "published.pt", tmp_path / "outdet.ckpt"
    torch.save(published, weights)
    line = refused("import-weights", "outdet", weights, "--stats", "semantickitti", "--out", out)
    assert line.startswith("derain: --data: SemanticKITTI has no rain")
    assert not out.exists()


def of_image_network(model: DerainingModule, prefix: str = "") -> dict[str, Tensor]:
    """The weights of a SalsaNext or LiSnowNet under the published names."""
    key = SALSANEXT_KEYS.get if isinstance(model, SalsaNext) else published_key
    return {f"{prefix}{key(name)}": tensor for name, tensor in model.network.state_dict().items()}


# Weights were published of these.
published_image_models = pytest.mark.parametrize(
    "image_model", ["salsanext", "lisnownet"], indirect=True
)


@published_image_models
@pytest.mark.parametrize(("prefix", "grid"), [("", "wads"), ("module.", "semantickitti")])
def test_weights_of_networks_on_range_images_come_with_their_grid(
    run_derain, image_model: DerainingModule, tmp_path: Path, prefix: str, grid: str
) -> None:
    weights, out = tmp_path / "published", tmp_path / "model.ckpt"
    torch.save(of_image_network(image_model, prefix), weights)
    outcome = run_derain(
        *("import-weights", image_model.NAME, weights),
        *("--stats", "kitti", "--grid", grid, "--out", out),
    )
    assert (outcome.code, outcome.err) == (0, "")
    model = load_model(out)
    card = load_card("kitti")
    assert (model.NAME, model.spec.data) == (image_model.NAME, card.name)
    assert model.spec.view["grid"] == grid_of(grid, "").as_dict()
    assert (model.spec.mean[0], model.spec.mean[-1]) == (card.range[0], card.mean[3])
    imported = model.network.state_dict()
    for name, tensor in image_model.network.state_dict().items():
        assert torch.equal(imported[name], tensor), name


def training_checkpoint(model: DerainingModule) -> dict[str, object]:
    """What SalsaNext's trainer saves, with the state of its optimiser and of its warm-up.

    Source: TiagoCortinhal/SalsaNext, trainer.py and warmupLR.py, whose state holds a CyclicLR.
    """
    optimizer = torch.optim.SGD(model.parameters(), lr=0.01, momentum=0.9)
    warm_up = torch.optim.lr_scheduler.CyclicLR(optimizer, 0, 0.01, 10, cycle_momentum=False)
    return {
        "epoch": 33,
        "state_dict": of_image_network(model, "module."),
        "optimizer": optimizer.state_dict(),
        "info": {"train_loss": 0.017, "best_val_iou": 0.94},
        "scheduler": {"initial_scheduler": warm_up, "last_epoch": 7, "finished": True},
    }


def test_a_checkpoint_as_salsanext_saves_it_will_do(
    run_derain, random_salsanext: SalsaNext, tmp_path: Path
) -> None:
    assert_imported(run_derain, random_salsanext, training_checkpoint(random_salsanext), tmp_path)


def assert_imported(
    run_derain, model: DerainingModule, content: dict[str, object], folder: Path
) -> None:
    """Imports a checkpoint and compares its weights with those of the model."""
    weights, out = folder / "valid_best", folder / "model.ckpt"
    torch.save(content, weights)
    options = ["--stats", "kitti", "--grid", "rehearse3d", "--out", out]
    outcome = run_derain("import-weights", model.NAME, weights, *options)
    assert (outcome.code, outcome.err) == (0, "")
    imported = load_model(out).network.state_dict()
    for name, tensor in model.network.state_dict().items():
        assert torch.equal(imported[name], tensor), name


@published_image_models
@pytest.mark.parametrize(
    ("options", "reason"),
    [
        ((), "weights do not say what grid they were trained on. Give --grid."),
        (("--grid", "mars"), "there is no grid named 'mars'. Known are semantickitti, rehearse3d"),
        (("--grid", "fitted"), "there are no scans to fit it to. Give a grid by its name."),
    ],
)
def test_a_grid_that_is_missing_or_unknown_is_one_line_and_exit_code_2(
    refused, image_model: DerainingModule, tmp_path: Path, options: tuple[str, ...], reason: str
) -> None:
    weights, out = tmp_path / "published", tmp_path / "model.ckpt"
    torch.save(of_image_network(image_model), weights)
    line = refused(
        "import-weights", image_model.NAME, weights, "--stats", "kitti", "--out", out, *options
    )
    assert reason in line
    assert not out.exists()


def test_a_network_that_sees_no_grid_is_given_none(
    run_derain, published: dict[str, Tensor], tmp_path: Path
) -> None:
    weights, out = tmp_path / "published.pt", tmp_path / "outdet.ckpt"
    torch.save(published, weights)
    options = ["--stats", "wads", "--grid", "wads", "--out", out]
    outcome = run_derain("import-weights", "outdet", weights, *options)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err == "derain: --grid: outdet sees neighbours, not a grid. Leave it out.\n"
    assert not out.exists()


@pytest.mark.parametrize(
    ("network", "weights", "stats", "reason"),
    [
        ("resnet", "published.pt", "wads", "resnet: no such network. Known are lisnownet"),
        ("outdet", "none.pt", "wads", "none.pt: there is no such file"),
        ("outdet", "published.pt", "mars", "mars: no such data card. Give a YAML file or one of"),
        ("outdet", "published.pt", "rehearse3d", "the data card has no statistics"),
        ("outdet", "other.pt", "wads", "the state_dict is of another network (1 keys missing"),
    ],
)
def test_what_cannot_be_imported_is_one_line_and_exit_code_2(
    refused,
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
    line = refused("import-weights", network, weights, "--stats", stats, "--out", "out.ckpt")
    assert reason in line
    assert {path.name for path in tmp_path.iterdir()} == {"other.pt", "published.pt"}
