"""What is wrong with scans: losses, copies, steps, and points between two surfaces."""

import math

import numpy as np
import pytest

from derain.errors import InputError
from derain.scan import Floats
from derain.simulation.arrays import Returns
from derain.simulation.classes import TrackClass
from derain.simulation.defects import SECTORS_OF_A_SCAN, Defects
from derain.simulation.sensor import Sensor

ROWS, COLUMNS = 40, 600
BEAMS = ROWS * COLUMNS
NEAR, FAR = 8.0, 9.5


def of_ranges(range_: Floats) -> Returns:
    """Cars nearer than 9 m before a background, one return a beam."""
    label = np.where(range_ < 9, TrackClass.CAR, TrackClass.BACKGROUND).astype(np.int64)
    beam = np.arange(len(range_))
    return Returns(range_, np.full(len(range_), 0.4), label, beam)


def posts(near: float = NEAR, far: float = FAR) -> Returns:
    """Ten columns near, ten far, and so on."""
    return of_ranges(np.where(np.arange(BEAMS) % COLUMNS // 10 % 2, far, near))


def within(count: int, tries: int, share: float) -> bool:
    """Whether so many are within four standard deviations of a binomial distribution's mean."""
    return abs(count - tries * share) <= 4 * math.sqrt(tries * share * (1 - share))


def test_by_default_nothing_is_wrong() -> None:
    generator, given = np.random.default_rng(0), posts()
    state = generator.bit_generator.state
    nothing = Defects()
    assert nothing.at_borders(given, COLUMNS, dual=True, generator=generator) is given
    assert nothing.received(given, (ROWS, COLUMNS), generator).all()
    assert (nothing.stepped(given.range) == given.range).all()
    assert (nothing.reported(given.beam, generator) == given.beam).all()
    assert generator.bit_generator.state == state  # and nothing was drawn


def test_returns_are_lost_each_by_itself_and_rows_and_sectors_as_a_whole() -> None:
    generator = np.random.default_rng(2)
    received = Defects(dropped=0.2).received(posts(), (ROWS, COLUMNS), generator)
    assert within(np.count_nonzero(~received), BEAMS, 0.2)
    for defects, parts in (
        (Defects(dropped_rows=0.1), ROWS),
        (Defects(dropped_sectors=0.1), SECTORS_OF_A_SCAN),
    ):
        lost = 0
        for _ in range(20):
            received = defects.received(posts(), (ROWS, COLUMNS), generator).reshape(ROWS, COLUMNS)
            if parts == SECTORS_OF_A_SCAN:  # all rows of some columns that follow each other
                received = received.reshape(ROWS, parts, -1).swapaxes(0, 1).reshape(parts, -1)
            assert (received == received[:, :1]).all()
            lost += np.count_nonzero(~received[:, 0])
        assert within(lost, 20 * parts, 0.1)


def test_a_return_that_is_alone_is_copied_and_distances_go_to_the_nearest_step() -> None:
    assert Defects(range_step=0.5).stepped(np.array([1.2, 1.3])).tolist() == [1.0, 1.5]
    beam = np.array([0, 1, 1, 2, 5, 5, 6])
    rows = Defects(copies=1.0).reported(beam, np.random.default_rng(0))
    assert rows.tolist() == [0, 0, 1, 2, 3, 3, 4, 5, 6, 6]
    some = Defects(copies=0.3).reported(np.arange(BEAMS), np.random.default_rng(5))
    assert within(len(some) - BEAMS, BEAMS, 0.3)
    sensor = Sensor(rows=ROWS, columns=COLUMNS, defects=Defects(copies=1.0, range_step=0.02))
    scan = sensor.measure(posts(), np.random.default_rng(0))
    assert np.abs(scan.range / 0.02 - np.rint(scan.range / 0.02)).max() < 1e-3
    assert len(scan) == 2 * BEAMS
    for column in (scan.xyz, scan.intensity, scan.label):
        assert (column[::2] == column[1::2]).all()


@pytest.mark.parametrize("beams", [0, 1, 2])
def test_few_beams_are_no_trouble(beams) -> None:
    given = of_ranges(np.arange(1.0, beams + 1))
    everything = Defects(0.5, 0.5, 0.5, 1.0, 0.0, 0.1, 1.0)
    sensor = Sensor(rows=1, columns=2, returns="dual", defects=everything)
    for seed in range(10):
        assert len(sensor.measure(given, np.random.default_rng(seed))) <= 2 * beams


def test_points_at_borders_lie_between_the_surfaces_and_nowhere_else() -> None:
    given = posts()
    mixed = Defects(mixed=0.4, merging=2.0).at_borders(
        given, COLUMNS, dual=False, generator=np.random.default_rng(6)
    )
    moved = np.flatnonzero(mixed.range != given.range)
    # A row has a border behind every tenth beam but the last, and none with the next row.
    assert (moved % 10 == 9).all()
    assert (moved % COLUMNS != COLUMNS - 1).all()
    assert within(len(moved), ROWS * (COLUMNS // 10 - 1), 0.4)
    assert (mixed.range[moved] > NEAR).all()
    assert (mixed.range[moved] < FAR).all()
    share = (mixed.range[moved] - given.range[moved]) / (FAR - NEAR)
    assert np.abs(share).mean() == pytest.approx(0.5, abs=0.05)
    assert (mixed.label[moved] == TrackClass.CAR).all()
    still = np.delete(np.arange(BEAMS), moved)
    assert (mixed.label[still] == given.label[still]).all()


def test_surfaces_too_far_apart_to_merge_stay_or_are_two_returns() -> None:
    given, defects = posts(NEAR, 30.0), Defects(mixed=0.5, merging=2.0)
    single = defects.at_borders(given, COLUMNS, dual=False, generator=np.random.default_rng(7))
    assert (single.range == given.range).all()
    dual = defects.at_borders(given, COLUMNS, dual=True, generator=np.random.default_rng(7))
    assert (np.diff(dual.beam) >= 0).all()
    second = np.flatnonzero(np.diff(dual.beam) == 0)
    assert within(len(second), ROWS * (COLUMNS // 10 - 1), 0.5)
    assert {(a, b) for a, b in zip(dual.range[second], dual.range[second + 1], strict=True)} == {
        (NEAR, 30.0),
        (30.0, NEAR),
    }
    assert (dual.power[second] >= dual.power[second + 1]).all()  # the strongest first
    assert (dual.reflectivity[second] + dual.reflectivity[second + 1] <= 0.4 + 1e-12).all()
    assert np.array_equal(np.unique(dual.beam), given.beam)
    assert ((dual.label == TrackClass.CAR) == (dual.range == NEAR)).all()


def test_a_drop_takes_no_part_in_a_border_and_nothing_becomes_rain() -> None:
    given = posts()
    rain = np.random.default_rng(8).random(BEAMS) < 0.3
    given.label[rain] = TrackClass.RAIN
    mixed = Defects(mixed=1.0).at_borders(
        given, COLUMNS, dual=False, generator=np.random.default_rng(9)
    )
    moved = mixed.range != given.range
    assert moved.any()
    assert not (moved & rain).any()
    assert not (moved[:-1] & rain[1:]).any()
    assert ((mixed.label == TrackClass.RAIN) == rain).all()


@pytest.mark.parametrize(
    ("name", "value"),
    [("dropped", 1.1), ("dropped_sectors", math.nan), ("copies", -1.0), ("merging", math.inf)],
)
def test_impossible_defects_are_refused_by_name(name, value) -> None:
    with pytest.raises(InputError, match=f"defects: {name}: "):
        Defects(**{name: value})
