"""Cues: what the network makes of a scan's brightness, in whatever unit, order and direction."""

from copy import deepcopy
from dataclasses import replace

import lightning
import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor
from torch.nn import functional

from derain.datamodules.base import Loading
from derain.datamodules.in_memory import InMemory
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.learning.batch import Batch, Sample
from derain.models.cues import CueFusion
from derain.models.cues.geometry import in_steps
from derain.models.cues.network import LARGEST_LOG_ODDS, Calibration
from derain.scan import Bools, Scan
from derain.views.intensity_rank import INTENSITY_RANKS
from derain.views.isolated_points import SHELLS
from derain.views.probability import probability_of_rain


def labelled(seed: int, drops: int = 300, gain: float = 1.0) -> Scan:
    """A bright scene with dim drops in the air."""
    generator = np.random.default_rng(seed)
    ground = np.concatenate([scene(3000)[:, :3], generator.uniform(50, 255, (3000, 1))], axis=1)
    flying = generator.uniform(-8, 8, (drops, 3))
    dim = np.concatenate([flying, generator.uniform(0, 10, (drops, 1))], axis=1)
    points = np.concatenate([ground, dim]) * [1, 1, 1, gain]
    return Scan.of(points.astype(np.float32)).with_label(np.repeat([40, 110], [3000, drops]))


@pytest.fixture(scope="module")
def trained(make_trainer) -> CueFusion:
    """Trained on a few scenes."""
    lightning.seed_everything(0)
    model = CueFusion(learning_rate=1e-2)
    train, validation = [labelled(seed) for seed in range(4)], [labelled(9)]
    data = InMemory(train, validation, card="wads", loading=Loading(batch_size=2))
    make_trainer(25).fit(model, data)
    return model.eval()


@pytest.fixture(scope="module")
def packaged() -> Derainer:
    """The model that comes with derain, which is one of cues."""
    return Derainer(threads=1)


def test_brightness_helps_whatever_its_unit(trained) -> None:
    scan = labelled(20)
    rain = scan.label == 110

    def called(scan: Scan) -> Bools:
        seen = trained.spec.make_view()(scan)
        logits = trained.logits_of(Batch.of([Sample.of(scan, seen, trained.card)])).detach()
        return seen.back(probability_of_rain(logits.numpy())) > 0.5

    def iou(answer: Bools) -> float:
        return float((answer & rain).sum() / (answer | rain).sum())

    usual = called(scan)
    assert iou(usual) > 0.8
    np.testing.assert_array_equal(called(labelled(20, gain=1 / 255)), usual)
    alike = called(replace(scan, intensity=np.full(len(scan), 7, np.float32)))
    assert iou(alike) < iou(usual) - 0.05


@pytest.mark.parametrize("doubt", [-20, 20])
def test_without_intensities_rain_is_the_likelier_the_more_of_it_there_is(trained, doubt) -> None:
    scan, network, view = labelled(23), deepcopy(trained.network), trained.spec.make_view()
    network.rounds[-1][-1].bias.data -= doubt

    def answer(scan: Scan, added: float) -> Tensor:
        inputs = {name: torch.from_numpy(each) for name, each in view(scan).inputs().items()}
        inputs |= {"step": inputs["step"][0], "counts": inputs["counts"][0]}
        network.without_intensity = added
        with torch.no_grad():
            return network.answers(**inputs)[-2]

    dark = replace(scan, intensity=None)
    usual = answer(dark, 0)
    rain = float(usual.sigmoid().sum()) / len(scan)
    assert (0 < rain < 0.01) == (doubt > 0)
    raised = torch.full_like(usual, 2 * min(rain / 0.01, 1))
    # Sums of many floats may differ from one call to the next, by how threads share them.
    torch.testing.assert_close(answer(dark, 2) - usual, raised, rtol=0, atol=1e-3)
    torch.testing.assert_close(answer(scan, 2), answer(scan, 0), rtol=0, atol=1e-3)


@pytest.mark.parametrize(("drops", "are_rain"), [(0, False), (60, True)])
def test_dim_specks_right_before_the_sensor_alone_are_its_carrier(
    packaged, drops, are_rain
) -> None:
    scan = labelled(22, drops=0)
    far = scan.take(np.linalg.norm(scan.xyz, axis=1) > 6.5)
    direction = np.random.default_rng(0).normal(size=(drops + 3, 3))
    direction /= np.linalg.norm(direction, axis=1, keepdims=True)
    ranges = np.concatenate([np.linspace(2.5, 5.5, drops), [1.0, 1.2, 1.4]])
    dim = np.column_stack([direction * ranges[:, None], np.full(drops + 3, 2.0)])
    points = np.concatenate([np.column_stack([far.xyz, far.intensity]), dim])
    specks = packaged.probability(Scan.of(points.astype(np.float32)))[-3:]
    assert ((specks > 0.5) == are_rain).all()


def test_points_without_intensity_are_judged_as_in_a_scan_that_has_none(packaged) -> None:
    scan = labelled(25)
    dark = np.arange(len(scan)) % 3 == 0
    intensity = np.where(dark, np.float32(np.nan), scan.intensity)
    judgement = packaged.judge_silently(replace(scan, intensity=intensity))
    of_blank = packaged.probability(replace(scan, intensity=None))
    np.testing.assert_array_equal(judgement.probability[dark], of_blank[dark])
    of_others = packaged.probability(scan.take(~dark))
    np.testing.assert_array_equal(judgement.probability[~dark], of_others)
    assert judgement.judged.all()
    assert judgement.share_of_rain == judgement.rain.mean()


def test_intensities_that_mean_nothing_are_judged_as_none(packaged) -> None:
    scan = labelled(26, drops=2000)
    drawn = np.random.default_rng(0).integers(0, 256, len(scan)).astype(np.float32)
    found = packaged.probability(replace(scan, intensity=drawn))
    blank = packaged.probability(replace(scan, intensity=None))
    np.testing.assert_allclose(found, blank, atol=1e-3)
    assert (blank > 0.5).mean() > 0.1


def test_rows_in_another_order_are_judged_alike(packaged) -> None:
    scan = labelled(21)
    order = np.random.default_rng(0).permutation(len(scan))
    shuffled = packaged.probability(scan.take(order))
    np.testing.assert_allclose(shuffled, packaged.probability(scan)[order], atol=1e-4)


def test_scans_of_a_batch_do_not_influence_each_other(trained) -> None:
    view = trained.spec.make_view()
    scans = labelled(30), labelled(31, drops=30)
    samples = [Sample(scan, view(scan), None) for scan in scans]
    with torch.no_grad():
        together = trained.logits_of(Batch.of(samples))
        alone = [trained.logits_of(Batch.of([sample])) for sample in samples]
    torch.testing.assert_close(together, torch.cat(alone))


def test_a_batch_without_a_point_to_learn_from_has_no_loss(trained) -> None:
    empty = Scan.of(np.zeros((0, 4))).with_label(np.zeros(0, np.int64))
    seen = trained.spec.make_view()(empty)
    losses, _ = trained.losses(Batch.of([Sample.of(empty, seen, trained.card)]))
    assert losses["loss"] == 0


def test_it_needs_its_neighbours() -> None:
    with pytest.raises(InputError, match="neighbours: 8 are too few"):
        CueFusion(neighbours=8)


@pytest.mark.parametrize("turn", [0.3, 2.0, np.pi])
def test_neighbours_in_steps_are_the_same_in_every_direction_and_at_every_range(turn) -> None:
    generator = np.random.default_rng(0)
    points = generator.normal((10, 0, 0), 1, (40, 3))
    neighbours = torch.tensor(np.stack([generator.permutation(40)[:5] for _ in range(12)], 1))

    def seen(xyz: np.ndarray, step: float) -> torch.Tensor:
        places = torch.tensor(xyz)
        near = functional.embedding(neighbours, places)
        distances = (near - near[0]).norm(dim=2)
        return in_steps(places, distances, neighbours, torch.tensor(step))[0]

    turned = points @ [[np.cos(turn), np.sin(turn), 0], [-np.sin(turn), np.cos(turn), 0], [0, 0, 1]]
    torch.testing.assert_close(seen(turned, 0.01), seen(points, 0.01), rtol=1e-6, atol=1e-6)
    torch.testing.assert_close(seen(7 * points, 0.01), seen(points, 0.01), rtol=1e-6, atol=1e-6)
    mirrored = points * [1, -1, 1]
    torch.testing.assert_close(seen(mirrored, 0.01), seen(points, 0.01), rtol=1e-6, atol=1e-6)


def test_farther_aside_and_up_are_measured_along_the_beam_and_across_it() -> None:
    places = torch.tensor([[10.0, 0, 0], [10.5, 0, 0], [10, 0.2, 0], [10, 0, -0.3]]).double()
    neighbours = torch.arange(4)[:, None]
    distances = (places - places[0]).norm(dim=1)[:, None]
    seen, far = in_steps(places, distances, neighbours, torch.tensor(0.01).double())
    length = 0.1  # a step at 10 m
    apart, farther, aside, risen = seen[:, :, 0]
    torch.testing.assert_close(apart, torch.log(distances[1:, 0] / length + 0.01))
    ends = places.norm(dim=1)
    torch.testing.assert_close(farther.sinh() * length, (ends[1:] - ends[0]))
    torch.testing.assert_close(aside.sinh() * length, places[1:, 1])
    torch.testing.assert_close(risen.sinh() * length, places[1:, 2])
    assert far[0] == 0


def drawn(seed: int, points: int = 500) -> tuple[Tensor, Tensor, Tensor]:
    """Points by shell and rank, the cell of each of them, and how probably it is rain."""
    generator = np.random.default_rng(seed)
    cell = torch.tensor(generator.integers(0, SHELLS * INTENSITY_RANKS, points))
    return counted(cell), cell, torch.tensor(generator.uniform(0, 1, points))


def counted(cell: Tensor) -> Tensor:
    counts = torch.bincount(cell, minlength=SHELLS * INTENSITY_RANKS)
    return counts.reshape(SHELLS, INTENSITY_RANKS).float()


def smoothed(counts: np.ndarray) -> np.ndarray:
    for axis in (0, 1):
        padding = [(1, 1) if axis == number else (0, 0) for number in (0, 1)]
        wide = np.pad(counts, padding, mode="edge")
        take = [wide.take(range(n, n + counts.shape[axis]), axis) for n in range(3)]
        counts = 0.25 * take[0] + 0.5 * take[1] + 0.25 * take[2]
    return counts


def expected(rain: np.ndarray, rest: np.ndarray) -> np.ndarray:
    """Log-odds by shell and rank, of counts that are smoothed."""
    both = rain + rest + 1e-12
    usual = 100 * both / both.sum(1, keepdims=True)
    in_rain = (rain + usual) / (rain.sum(1, keepdims=True) + 100)
    in_rest = (rest + usual) / (rest.sum(1, keepdims=True) + 100)
    return np.log(in_rain / in_rest).clip(-LARGEST_LOG_ODDS, LARGEST_LOG_ODDS)


@given(st.integers(0, 2**32 - 1))
def test_log_odds_are_those_of_smoothed_counts(seed) -> None:
    counts, cell, probability = drawn(seed)
    rain, rest = np.zeros((2, SHELLS, INTENSITY_RANKS))
    for number, p in zip(cell.tolist(), probability.tolist(), strict=True):
        place = divmod(number, INTENSITY_RANKS)
        rain[place] += p
        rest[place] += 1 - p
    rain, rest = smoothed(rain), smoothed(rest)
    found = Calibration(counts, cell)(probability)
    occurring = np.append(rain + rest > 0.1, np.ones((1, INTENSITY_RANKS), bool), axis=0)
    rain, rest = (np.append(each, each.sum(0)[None], axis=0) for each in (rain, rest))
    by_hand = expected(rain, rest)
    np.testing.assert_allclose(found.log_odds[occurring], by_hand[occurring], atol=1e-4)
    np.testing.assert_allclose(found.rain, rain, rtol=1e-9)


def test_where_all_are_alike_or_none_is_rain_brightness_means_nothing() -> None:
    counts, cell, probability = drawn(0)
    darkest = cell - cell % INTENSITY_RANKS
    alike = Calibration(counted(darkest), darkest)(probability).by_cell()
    dry = Calibration(counts, cell)(torch.zeros_like(probability)).by_cell()
    assert alike[:2, darkest].abs().max() < 1e-6
    assert dry[:2, cell].abs().max() < 1e-6


def test_points_that_are_not_asked_about_count_as_no_rain() -> None:
    counts, cell, probability = drawn(1)
    asked = torch.arange(len(cell)) % 3 == 0
    some = Calibration(counts, cell[asked])(probability[asked])
    every = Calibration(counts, cell)(probability * asked)
    torch.testing.assert_close(some.by_cell(), every.by_cell())
