"""The street that a sensor drives along."""

import numpy as np
import pytest

from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface
from derain.simulation.street import SIGHT, STEP, Street, lay_out_street

# A little over what is stepped or driven on, and the roof of a van, metres.
LOWEST, HIGHEST = STEP + 0.05, 2.2


def drawn(seed: int, length: float = 20.0) -> tuple[Street, list[Surface]]:
    generator = np.random.default_rng(seed)
    street = Street.draw(length, generator)
    return street, list(lay_out_street(street, generator))


def in_the_way(surface: Surface) -> np.ndarray:
    """Corners at a height at which a vehicle is, (K, 3)."""
    corners = surface.triangles.reshape(-1, 3)
    return corners[(corners[:, 2] > LOWEST) & (corners[:, 2] < HIGHEST)]


@pytest.mark.parametrize("seed", range(3))
def test_nothing_stands_in_the_lanes_and_in_the_side_streets(seed: int) -> None:
    street, surfaces = drawn(seed)
    there = {surface.label for surface in surfaces}
    assert there == set(TrackClass) - {TrackClass.RAIN, TrackClass.SPRINKLER, TrackClass.TARGET}
    corners = np.concatenate([in_the_way(surface) for surface in surfaces])
    assert np.abs(corners[:, 1] - street.axis).min() > street.lane
    for middle in street.junctions:
        assert np.abs(corners[:, 0] - middle).min() > street.lane


@pytest.mark.parametrize("length", [0.0, 30.0])
def test_things_stand_on_both_sides_all_along_the_drive_and_the_sight(length: float) -> None:
    street, surfaces = drawn(1, length)
    corners = np.concatenate([in_the_way(surface) for surface in surfaces])
    for side in (-1, 1):
        beside = corners[side * (corners[:, 1] - street.axis) > 0]
        near = beside[np.abs(beside[:, 1] - street.axis) < 15]
        for begin in np.arange(-SIGHT, length + SIGHT - 30, 10):
            assert ((near[:, 0] > begin) & (near[:, 0] < begin + 30)).any()
    assert corners[:, 0].min() < -SIGHT + 20
    assert corners[:, 0].max() > length + SIGHT - 20
