"""LiSnowNet as it is trained: its rule for rain, its losses, and that it reads no label."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import pytest
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from numpy.typing import NDArray
from recorded_scenes import write_scenes

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.learning.batch import Batch
from derain.models.lisnownet import LiSnowNet
from derain.models.lisnownet.selection_rule import FEWEST, SelectionRule, cube_roots, rain_logits
from derain.models.lisnownet.sparsity import sparsity_loss
from derain.models.measured import MONITOR
from derain.scan import Bools, Floats, Scan
from derain.sources import file_frame
from derain.views.probability import probability_of_rain
from derain.views.range_image import RangeImage
from derain.views.spherical_grid import grid_of

from ..conftest import assert_same
from .test_network import published

WADS = load_card("wads")
PUBLISHED = SelectionRule(residual=0.008, ground=-1.8, intensity=2 / 255, near=2.5)

# Calls so much of a scene rain that its IoU means something.
LENIENT = {"residual": 1e-6, "ground": -10.0, "intensity": 1.0}


def test_the_spec_holds_how_the_network_is_used() -> None:
    model = LiSnowNet(grid="wads", rule={"residual": 0.008, "near": 2.5}, threshold=0.25)
    spec = model.spec_for(WADS)
    assert (spec.network, spec.threshold) == ("lisnownet", 0.25)
    assert spec.channels == ("range", "z", "intensity")
    assert spec.units == ("m", "m", "0..255")
    assert spec.means["intensity"] == WADS.statistics("intensity")[0]
    assert spec.view["grid"] == grid_of("wads", "").as_dict()
    assert SelectionRule(**spec.rule) == PUBLISHED
    assert (spec.data, spec.licence, spec.rain) == ("WADS", WADS.licence, (110,))


@pytest.mark.parametrize(
    ("distance", "intensity", "full_scale", "seen"),
    [
        (8.0, 0.125 * 255, 255.0, (2.0, 0.5)),
        (1000.0, 255.0, 255.0, (10.0, 1.0)),
        (1e-6, 300.0, 255.0, (0.01, 1.0)),
        (0.0, -5.0, 255.0, (0.0, 0.0)),
        (27.0, 65_535.0, 65_535.0, (3.0, 1.0)),
    ],
)
def test_the_network_sees_cube_roots(distance, intensity, full_scale, seen) -> None:
    image = torch.tensor([distance, -1.0, intensity])[None, :, None, None]
    roots = cube_roots(image, SelectionRule(full_scale=full_scale))
    np.testing.assert_allclose(roots.flatten(), seen, rtol=1e-6)


def snow_as_published(image: Floats, change: Floats, rule: SelectionRule) -> Bools:
    """The published rule, word for word (Source: M.-Y. Yu et al., IROS 2022)."""
    distance, height, intensity = image
    of_range, of_intensity = change
    snow = of_range * of_intensity**3 > rule.residual
    snow &= height > rule.ground
    snow &= intensity < rule.intensity * rule.full_scale
    return snow | (distance < rule.near)


@pytest.mark.parametrize(
    "rule",
    [PUBLISHED, SelectionRule(), SelectionRule(0.012, -0.5, 0.3, 1.0, 1.0)],
    ids=["published", "default", "share"],
)
def test_a_probability_above_one_half_is_snow_by_the_published_rule(rule) -> None:
    rng = np.random.default_rng(0)
    size = (40, 50)
    intensity = rng.choice([0.0, 1.0, 2.0, 3.0, 200.0], size) / 255 * rule.full_scale
    image = np.stack([rng.gamma(2, 4, size), rng.normal(-1.5, 1, size), intensity])
    image = image.astype(np.float32)
    seen = cube_roots(torch.from_numpy(image)[None], rule)
    denoised = seen + torch.from_numpy(rng.normal(0.2, 0.5, (1, 2, *size)).astype(np.float32))
    returned = torch.from_numpy(rng.random((1, 1, *size)) < 0.9)
    logits = rain_logits(torch.from_numpy(image)[None], returned, seen, denoised, rule)
    probability = probability_of_rain(logits.numpy()).reshape(size)
    change = (denoised - seen)[0].numpy()
    snow = snow_as_published(image.astype(np.float64), change.astype(np.float64), rule)
    snow &= returned.numpy()[0, 0]
    assert 0.05 < snow.mean() < 0.95
    np.testing.assert_array_equal(probability > 0.5, snow)


def test_the_probability_rises_with_the_residual() -> None:
    changes = torch.linspace(-2, 2, 101)
    denoised = torch.stack([changes, torch.full_like(changes, 0.5)])[None, :, None]
    image = torch.tensor([10.0, 0.0, 0.0])[None, :, None, None].expand(1, 3, 1, 101)
    seen, rule = torch.zeros(1, 2, 1, 101), SelectionRule(residual=0.125)
    logits = rain_logits(image, image[:, :1] > 0, seen, denoised, rule)
    margin = logits[:, 1] - logits[:, 0]
    # At twice the limit the margin is 4: a probability of .98.
    assert margin[100].item() == pytest.approx(4.0)
    assert (margin.diff() >= 0).all()
    assert margin.min() >= -20


@torch.no_grad()
def test_the_model_applies_its_rule_to_what_the_network_changed(image_network, sample) -> None:
    model = image_network(LiSnowNet, rule={"residual": 1.0, "near": 6.0})
    one = sample(model, scene())
    inputs = Batch.of([one]).inputs
    image = inputs["image"][0].double().numpy()
    share = np.clip(image[2] / 255, 0, 1)
    seen = torch.from_numpy(np.cbrt([image[0], share]).astype(np.float32))[None]
    change = (model.network(seen, inputs["valid"]) - seen)[0].double().numpy()
    snow = snow_as_published(image, change, model.selection)
    valid = one.view.valid
    assert 0.05 < snow[valid].mean() < 0.95
    probability = probability_of_rain(model(**inputs).numpy()).reshape(18, 60)
    np.testing.assert_array_equal((probability > 0.5)[valid], snow[valid])


def test_the_residual_is_l1_unless_another_norm_is_named() -> None:
    assert LiSnowNet().hparams["norm"] == "l1"
    with pytest.raises(InputError, match=r"no such norm: 'l3'\. Available: l1 and l2"):
        LiSnowNet(norm="l3")


@torch.no_grad()
@pytest.mark.parametrize(("alpha", "beta", "norm"), [(5.5, 0.5, "l1"), (3.0, 0.2, "l2")])
def test_the_losses_are_those_of_what_the_network_saw(
    image_network, sample, alpha, beta, norm
) -> None:
    model = image_network(LiSnowNet, alpha=alpha, beta=beta, norm=norm)
    batch = Batch.of([sample(model, scene(3000, seed)) for seed in range(2)])
    losses, logits = model.losses(batch)
    image, valid = batch.inputs["image"], batch.inputs["valid"]
    seen = torch.stack([image[:, 0], (image[:, 2] / 255).clamp(0, 1)], dim=1).pow(1 / 3)
    expected = sparsity_loss(model.network(seen, valid), seen, valid, alpha, beta, norm)
    assert set(losses) == {"loss", "wavelet", "fourier", "residual"}
    torch.testing.assert_close(losses["loss"], expected.loss)
    for part in ("wavelet", "fourier", "residual"):
        torch.testing.assert_close(losses[part], getattr(expected, part))
    torch.testing.assert_close(logits, model(**batch.inputs))


@torch.no_grad()
def test_published_weights_are_taken_over(image_network, sample) -> None:
    own = image_network(LiSnowNet)
    model = LiSnowNet.from_published(published(own.network), WADS, "wads").eval()
    assert (model.hparams["width"], model.spec.data) == (4, "WADS")
    assert model.spec.view["grid"] == grid_of("wads", "").as_dict()
    inputs = Batch.of([sample(own, scene())]).inputs
    seen = cube_roots(inputs["image"], SelectionRule(full_scale=255.0))
    assert torch.equal(model.network(seen, inputs["valid"]), own.network(seen, inputs["valid"]))
    # The rule is not in the weights: its constants are those of the default.
    assert model.selection == SelectionRule()


def test_weights_need_a_grid(image_network) -> None:
    weights = published(image_network(LiSnowNet).network)
    with pytest.raises(InputError, match=r"the grid .*Give --grid\."):
        LiSnowNet.from_published(weights, WADS)


class Progress(lightning.Callback):
    """Keeps what every validation measured."""

    def __init__(self) -> None:
        self.measured: list[dict[str, float]] = []

    def on_validation_end(self, trainer: lightning.Trainer, *_: Any) -> None:
        if not trainer.sanity_checking:
            self.measured.append({n: v.item() for n, v in trainer.callback_metrics.items()})

    def __getitem__(self, name: str) -> list[float]:
        return [values[name] for values in self.measured]


@dataclass(frozen=True)
class Run:
    """A finished training on the scenes in a folder."""

    folder: Path
    model: LiSnowNet
    progress: Progress
    best: dict[str, Any]


def write_four(folder: Path, validated: int = 300) -> Path:
    """Writes four labelled scenes, the last of which is for validation."""
    return write_scenes(folder, 300, 300, 300, validated, name="{}.bin", rain=110)


def swap_validation_labels(folder: Path) -> None:
    """Calls rain what is none, and the other way round."""
    label = np.fromfile(folder / "3.label", "<u4")
    write_labels(folder / "3.label", np.where(label == 110, 0, 110))


@pytest.fixture(scope="module")
def train(make_trainer, small_grid) -> Callable[..., Run]:
    """Trains on the scenes in a folder, from the same seed unless it is given another."""

    def fit(folder: Path, rule: dict[str, float] = LENIENT, seed: int = 0) -> Run:
        lightning.seed_everything(seed)
        model = LiSnowNet(small_grid, width=2, learning_rate=0.05, decay=0.5, rule=rule)
        progress = Progress()
        best = ModelCheckpoint(folder / "runs", "best", monitor=MONITOR, mode="max")
        trainer = make_trainer(epochs=4, callbacks=[progress, best], enable_checkpointing=True)
        parts = {"train": ["[012].bin"], "validation": ["3.bin"]}
        data = Folder(str(folder), "wads", **parts, loading=Loading(batch_size=3))
        trainer.fit(model, data)
        return Run(folder, model, progress, torch.load(best.best_model_path, weights_only=True))

    return fit


@pytest.fixture(scope="module")
def labelled(train, tmp_path_factory) -> Run:
    """A training on scenes that have their labels; the rule's residual is stated."""
    return train(write_four(tmp_path_factory.mktemp("labelled")))


def test_training_labels_are_not_opened_and_garbage_in_them_changes_nothing(
    train, labelled, tmp_path, monkeypatch
) -> None:
    write_four(tmp_path)
    (tmp_path / "0.label").write_bytes(b"garbage")
    write_labels(tmp_path / "1.label", np.full(300, 7777))
    (tmp_path / "2.label").unlink()
    opened, read = set(), file_frame.read_labels

    def recorded(path: Path, points: int) -> NDArray[np.uint32]:
        opened.add(path)
        return read(path, points)

    monkeypatch.setattr(file_frame, "read_labels", recorded)
    run = train(tmp_path)
    assert opened == {tmp_path / "3.label"}
    assert_same(labelled.model.state_dict(), run.model.state_dict())
    assert labelled.progress["val/iou"] == run.progress["val/iou"]
    assert labelled.model.spec == run.model.spec


def test_validation_labels_measure_and_choose_nothing(train, labelled, tmp_path) -> None:
    swap_validation_labels(write_four(tmp_path))
    run = train(tmp_path)
    assert labelled.progress["val/iou"] != run.progress["val/iou"]
    assert len(set(labelled.progress["val/iou"])) > 1
    assert labelled.progress[MONITOR] == run.progress[MONITOR]
    assert labelled.progress[MONITOR] == [-loss for loss in labelled.progress["val/loss"]]
    best = int(np.argmax(labelled.progress[MONITOR]))
    assert labelled.best["epoch"] == run.best["epoch"] == best
    assert_same(labelled.best["state_dict"], run.best["state_dict"])


def test_a_stated_residual_is_not_fitted(labelled) -> None:
    assert labelled.model.selection.residual == LENIENT["residual"]


def test_the_learning_rate_falls_after_every_epoch(labelled) -> None:
    (optimizer,) = labelled.model.trainer.optimizers
    assert isinstance(optimizer, torch.optim.Adam)
    assert [group["lr"] for group in optimizer.param_groups] == [pytest.approx(0.05 * 0.5**4)]


# From this seed a network comes that moves many returns nearer and makes them brighter at once, so
# that a residual can be fitted to them.
SEED = 2

# The constants that leave every return to the residual.
UNSTATED = {"ground": -10.0, "intensity": 1.0}


@pytest.fixture(scope="module")
def fitted(train, tmp_path_factory) -> Run:
    """A training whose residual was fitted to the many points of a validation scan."""
    return train(write_four(tmp_path_factory.mktemp("fitted"), validated=3000), UNSTATED, SEED)


def best_of(fitted: Run) -> tuple[LiSnowNet, RangeImage]:
    """The best checkpoint's model, and what it sees of the validation scan."""
    model = LiSnowNet(**fitted.best["hyper_parameters"]).eval()
    model.load_state_dict(fitted.best["state_dict"])
    points = np.fromfile(fitted.folder / "3.bin", np.float32).reshape(-1, 4)
    return model, model.spec.make_view()(Scan.of(points))


@torch.no_grad()
def test_the_residual_is_fitted_to_what_the_network_changes_in_the_validation_scans(
    train, fitted, tmp_path
) -> None:
    best, view = best_of(fitted)
    image, valid = (torch.from_numpy(array) for array in view.inputs().values())
    seen = cube_roots(image, best.selection)
    of_range, of_intensity = (best.network(seen, valid) - seen)[0].numpy()
    products = (of_range * of_intensity**3)[view.valid]
    assert np.count_nonzero(products > 0) > FEWEST
    expected = SelectionRule(**best.spec.rule).with_residual_of(products).residual
    assert best.selection.residual == pytest.approx(expected, rel=1e-3)
    assert best.selection.residual != SelectionRule().residual
    swap_validation_labels(write_four(tmp_path, validated=3000))
    with torch.enable_grad():
        again = train(tmp_path, UNSTATED, SEED)
    assert again.best["hyper_parameters"]["spec"] == fitted.best["hyper_parameters"]["spec"]


@torch.no_grad()
def test_the_scores_of_an_epoch_are_those_of_its_checkpoint(fitted) -> None:
    best, view = best_of(fitted)
    logits = best(**{name: torch.from_numpy(array) for name, array in view.inputs().items()})
    found = view.back(probability_of_rain(logits.numpy())) > best.spec.threshold
    rain = np.fromfile(fitted.folder / "3.label", "<u4") == 110
    iou = (found & rain).sum() / (found | rain).sum()
    assert 0 < iou < 1
    assert fitted.progress["val/iou"][fitted.best["epoch"]] == pytest.approx(iou)


def test_measuring_a_model_leaves_its_rule_as_it_is(fitted, make_trainer, tmp_path) -> None:
    model, spec = fitted.model, fitted.model.spec
    scene(300, seed=9).tofile(tmp_path / "9.bin")
    data = Folder(str(tmp_path), "wads", validation=["9.bin"])
    make_trainer(epochs=1).validate(model, data, verbose=False)
    assert model.spec == spec


def test_a_training_fits_the_rule_to_its_own_validation_scans(
    make_trainer, small_grid, tmp_path
) -> None:
    model, seen = LiSnowNet(small_grid, width=2), list[str]()
    look = model._image_of
    model._image_of = lambda scan: seen.append(Path(scan.name).name) or look(scan)
    for name in ("0.bin", "1.bin"):
        scene(300).tofile(tmp_path / name)
        data = Folder(str(tmp_path), "wads", train=[name], validation=[name])
        make_trainer(epochs=2).fit(model, data)
    assert seen == ["0.bin", "1.bin"]
