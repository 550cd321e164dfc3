"""3D-OutDet made relative: what it sees in steps of beams, trained, exported and among others."""

from dataclasses import replace
from pathlib import Path
from types import SimpleNamespace

import lightning
import numpy as np
import pytest
import torch
from lightning.pytorch.callbacks import ModelCheckpoint
from torch import Tensor

from derain.cards.card import load_card
from derain.datamodules.in_memory import InMemory
from derain.datamodules.scan_data import Loading
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export import onnx_file
from derain.export.candidates import fit_network_candidates
from derain.export.runtime import Derainer
from derain.models.relative_outdet import RelativeOutDet, RelativeOutDetNetwork
from derain.models.relative_outdet.network import in_steps
from derain.models.supervised import FIRST_DIVISOR, one_cycle
from derain.scan import Scan
from derain.views.candidates import Bound, Candidates
from derain.views.neighbour_search import NeighbourSearch

from .conftest import trained_on_scenes


def sphere(rows: int, columns: int, step: float, distance: float) -> np.ndarray:
    """Points on a grid of beams with even steps, radians, at one distance."""
    azimuth = step * (np.arange(columns) - columns / 2)
    inclination = step * (np.arange(rows) - rows / 2)
    a, i = (grid.ravel() for grid in np.meshgrid(azimuth, inclination))
    unit = np.stack([np.cos(i) * np.cos(a), np.cos(i) * np.sin(a), np.sin(i)], axis=1)
    return (distance * unit).astype(np.float32)


def logits(network: RelativeOutDetNetwork, xyz: np.ndarray) -> Tensor:
    neighbours, distances = NeighbourSearch(xyz, threads=1)(9)
    with torch.no_grad():
        scores: Tensor = network(*map(torch.from_numpy, (xyz, distances, neighbours)))
    return scores[:, 1]


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("context", [0, 16])
def test_the_rest_of_a_scan_matters_by_its_context_alone(seed, context) -> None:
    """What is four times as far off is no one's neighbour, and on beams of the same step."""
    torch.manual_seed(seed)
    network = RelativeOutDetNetwork(context=context).eval()
    here, there = (sphere(20, 40, 0.01, distance) for distance in (12.0, 48.0))
    alone = logits(network, here)
    among = logits(network, np.concatenate([here, there]))[: len(here)]
    if context:
        assert (alone - among).abs().min() > 1e-4  # of every point
    else:
        torch.testing.assert_close(alone, among)


def seen(xyz: np.ndarray, k: int = 9) -> tuple[Tensor, Tensor]:
    neighbours, distances = NeighbourSearch(xyz, threads=1)(k)
    return in_steps(*map(torch.from_numpy, (xyz, distances, neighbours)))


def test_a_step_of_even_beams_is_one_step() -> None:
    around, far = seen(sphere(40, 60, 0.004, 20.0))
    middle = slice(1000, 1400)
    nearest = torch.exp(around[middle, :4, 0])
    # The four nearest are a step away, and log(1 + .01) is what they are seen at.
    torch.testing.assert_close(nearest.median(), torch.tensor(1.01), atol=0.02, rtol=0)
    assert around[middle, :4, 1].abs().max() < 0.05  # none is farther from the sensor
    torch.testing.assert_close(far[middle], torch.log(torch.full((400,), 2.0)))


@pytest.mark.parametrize("scale", [0.25, 4.0])
def test_what_is_seen_does_not_depend_on_how_far_the_scene_is(scale) -> None:
    generator = np.random.default_rng(0)
    xyz = sphere(20, 40, 0.01, 12.0) * generator.uniform(0.9, 1.1, (800, 1)).astype(np.float32)
    near, here = seen(xyz)
    other, there = seen((scale * xyz).astype(np.float32))
    torch.testing.assert_close(near, other, atol=2e-3, rtol=2e-3)
    torch.testing.assert_close(there - here, torch.full((800,), float(np.log(scale))))


def test_what_is_seen_does_not_depend_on_where_the_sensor_looks() -> None:
    xyz = np.random.default_rng(1).normal(0, 10, (500, 3)).astype(np.float32)
    angle = 2.0
    turn = np.array(
        [[np.cos(angle), np.sin(angle), 0], [-np.sin(angle), np.cos(angle), 0], [0, 0, 1]]
    )
    mirror = np.diag([1.0, -1.0, 1.0])
    for change in (turn, mirror):
        torch.testing.assert_close(
            seen(xyz)[0], seen((xyz @ change).astype(np.float32))[0], atol=5e-3, rtol=5e-3
        )


def test_a_drop_in_front_of_a_wall_is_many_steps_from_everything() -> None:
    wall = sphere(40, 60, 0.004, 20.0)
    drop = np.array([[8.0, 0, 0]], np.float32)
    around, _ = seen(np.concatenate([wall, drop]))
    assert torch.exp(around[-1, 0, 0]) > 100
    assert (around[-1, :, 1] > 5).all()  # all of it is farther off
    assert torch.exp(around[:-1, 0, 0]).median() < 1.1


@pytest.mark.parametrize("points", [0, 1, 2, 5])
def test_few_points_give_finite_numbers(points) -> None:
    around, far = seen(np.random.default_rng(0).normal(0, 5, (points, 3)).astype(np.float32))
    assert around.shape == (points, 8, 4)
    assert torch.isfinite(around).all()
    assert torch.isfinite(far).all()


def labelled(seed: int, drops: int = 300) -> Scan:
    """A scene with drops in the air: WADS's falling snow."""
    generator = np.random.default_rng(seed)
    flying = np.concatenate([generator.uniform(-8, 8, (drops, 3)), np.zeros((drops, 1))], axis=1)
    points = np.concatenate([scene(3000), flying])
    return Scan.of(points).with_label(np.repeat([40, 110], [3000, drops]))


@pytest.fixture(scope="module")
def trained(make_trainer) -> RelativeOutDet:
    """Trained on a few scenes."""
    return trained_on_scenes(make_trainer(25), lambda: RelativeOutDet(learning_rate=1e-2), labelled)


def test_it_learns_drops_and_is_blind_to_intensity(trained, tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: hard_cases(largest=3000))
    onnx_file.export(trained, tmp_path / "model.onnx")
    derainer = Derainer(str(tmp_path / "model.onnx"))
    scan = labelled(20)
    called, rain = derainer(scan), scan.label == 110
    assert (called & rain).sum() / (called | rain).sum() > 0.6
    bright = replace(scan, intensity=np.full(len(scan), 200, np.float32))
    np.testing.assert_array_equal(derainer(bright), called)


def test_scans_of_a_batch_do_not_influence_each_other(trained, judges_apart) -> None:
    judges_apart(trained, labelled(1), labelled(2, drops=5), Scan.of(scene(40)))


def test_it_takes_no_candidates(trained) -> None:
    """Its answer for a point depends on all the others, so that none may be left out."""
    candidates = Candidates((Bound("range", most=20.0),))
    view = trained.spec.make_view()
    assert trained.accepts_view(view)
    assert not trained.accepts_view(view.with_candidates(candidates))
    with pytest.raises(InputError, match="relative_outdet"):
        RelativeOutDet().adopt(replace(trained.spec, candidates=candidates))
    with pytest.raises(InputError, match="--candidates: relative_outdet judges every point alike"):
        fit_network_candidates(trained, [labelled(3)], load_card("wads"))


def test_too_small_a_neighbourhood_is_refused() -> None:
    with pytest.raises(InputError, match="neighbours"):
        RelativeOutDet(neighbours=3)


def test_a_learning_rate_of_one_cycle_needs_a_last_step() -> None:
    model = RelativeOutDet()
    model.trainer = SimpleNamespace(estimated_stepping_batches=float("inf"))
    with pytest.raises(InputError, match="max_epochs"):
        one_cycle(model)


@pytest.mark.parametrize("steps", [1, 2, 9, 10, 11, 40])
def test_a_learning_rate_of_one_cycle_begins_low_however_short_the_training(steps) -> None:
    model = RelativeOutDet()
    model.trainer = SimpleNamespace(estimated_stepping_batches=steps)
    schedule = one_cycle(model)["lr_scheduler"]["scheduler"]
    rates = [schedule.get_last_lr()[0]]
    for _ in range(steps - 1):
        schedule.optimizer.step()
        schedule.step()
        rates += schedule.get_last_lr()
    highest = model.hparams["learning_rate"]
    assert rates[0] == pytest.approx(highest / FIRST_DIVISOR)
    assert max(rates) <= highest


def test_a_training_of_one_cycle_goes_on_with_steps_of_as_many_scans_alone(
    make_trainer, tmp_path
) -> None:
    scans = [labelled(seed) for seed in range(2)]

    def fit(batch_size: int, checkpoint: Path | None = None) -> lightning.Trainer:
        every = ModelCheckpoint(tmp_path, filename="{epoch}", save_top_k=-1)
        trainer = make_trainer(2, callbacks=[every], enable_checkpointing=True)
        data = InMemory(scans, scans, card="wads", loading=Loading(batch_size=batch_size))
        trainer.fit(RelativeOutDet(), data, ckpt_path=checkpoint)
        return trainer

    assert fit(batch_size=2).global_step == 2
    first = tmp_path / "epoch=0.ckpt"
    assert fit(batch_size=2, checkpoint=first).global_step == 2
    with pytest.raises(InputError, match="learning rate for 2 steps, where this run takes 4"):
        fit(batch_size=1, checkpoint=first)
