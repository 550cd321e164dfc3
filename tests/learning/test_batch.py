"""Batches of scans: packed together, taken apart again."""

import pickle

import numpy as np
import pytest
import torch

from derain.cards.card import DataCard
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch, Sample
from derain.scan import Scan
from derain.views.neighbours import Neighbourhoods, NeighbourView
from derain.views.range_image import RangeView
from derain.views.spherical_grid import SphericalGrid
from derain.views.view import IGNORED

SIZES = (12, 0, 1, 30)


def sample(points: int, labelled: bool = True) -> Sample:
    rng = np.random.default_rng(points)
    scan = Scan.of(rng.normal(size=(points, 4)))
    view = NeighbourView(5)(scan)
    target = torch.from_numpy(view.target(rng.random(points) < 0.5))
    return Sample(scan, view, target if labelled else None)


SAMPLES = [sample(points) for points in SIZES]


def test_a_batch_is_its_scans_one_after_the_other() -> None:
    batch = Batch.of(SAMPLES)
    assert batch.cells == list(SIZES)
    assert list(batch.inputs) == ["points", "distances", "neighbours"]
    inputs = [batch.split(tensor) for tensor in batch.inputs.values()]
    for own, points, distances, neighbours, target in zip(
        SAMPLES, *inputs, batch.split(batch.target), strict=True
    ):
        np.testing.assert_array_equal(points, own.view.points)
        np.testing.assert_array_equal(distances, own.view.distances)
        assert torch.equal(target, own.target)
        # Wherever they lie in the batch, neighbours are at the coordinates they were at alone.
        np.testing.assert_array_equal(
            batch.inputs["points"][neighbours], own.view.points[own.view.neighbours]
        )


@pytest.mark.parametrize("unlabelled", [1, 2])
def test_a_batch_has_targets_only_if_every_scan_has(unlabelled) -> None:
    samples = [sample(9, labelled=False)] * unlabelled + [sample(5)] * (2 - unlabelled)
    assert Batch.of(samples).target is None


views = pytest.mark.parametrize(
    "view",
    [NeighbourView(5), RangeView(SphericalGrid.even(8, 30, (-30, 30)))],
    ids=["neighbours", "range"],
)


@views
def test_cells_of_unknown_points_are_not_to_be_judged(view) -> None:
    card = DataCard("ours", {0: "ground", 3: "rain", 9: "unknown"}, rain=(3,), unknown=(9,))
    rng = np.random.default_rng(0)
    scan = Scan.of(scene(200)).with_label(rng.choice([0, 3, 9], 200))
    viewed = view(scan)
    target = Sample.of(scan, viewed, card).target
    assert Sample.of(scan.with_label(None), viewed, card).target is None
    # Rows as cells see them: the first of those at one position, the nearest in a pixel.
    row = viewed.first if isinstance(viewed, Neighbourhoods) else viewed.winner
    expected = np.array([0, 0, 0, 1, 0, 0, 0, 0, 0, IGNORED])[scan.label[row]]
    np.testing.assert_array_equal(target, np.where(row >= 0, expected, IGNORED))
    assert set(expected.tolist()) == {0, 1, IGNORED}


@views
@pytest.mark.parametrize("measured", [True, False])
def test_only_a_batch_that_is_measured_carries_its_scans(view, measured) -> None:
    scans = [Scan.of(scene(size, seed=size)) for size in (200, 0, 90)]
    seen = [view(scan) for scan in scans]
    pairs = zip(scans, seen, strict=True)
    batch = Batch.of([Sample(scan, viewed, None, measured) for scan, viewed in pairs])
    sent: Batch = pickle.loads(pickle.dumps(batch))
    scores = sent.split(torch.rand(sum(batch.cells)))
    assert len(sent.measured) == measured * len(scans)
    for scan, viewed, score, carried in zip(scans, seen, scores, sent.measured, strict=False):
        np.testing.assert_array_equal(carried.scan.xyz, scan.xyz)
        np.testing.assert_array_equal(
            carried.back_projection(score.numpy()), viewed.back(score.numpy())
        )
    # Of a point its coordinates, intensity, range and pixel; of a pixel what it shows.
    most = sum(44 * len(scan) + 4 * viewed.size for scan, viewed in zip(scans, seen, strict=True))
    tensors = sum(tensor.nbytes for tensor in batch.inputs.values())
    assert len(pickle.dumps(batch)) < tensors + measured * most + 5000  # names, shapes and types


def test_tensors_follow_to_another_device_and_scans_stay() -> None:
    batch = Batch.of(SAMPLES)
    moved = batch.to(torch.device("meta"))
    assert {tensor.device.type for tensor in [*moved.inputs.values(), moved.target]} == {"meta"}
    assert moved.cells == batch.cells
    assert moved.measured is batch.measured
    assert Batch.of([sample(3, labelled=False)]).to(torch.device("meta")).target is None
