"""Returns are read from a file's columns, which agree with directions."""

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.files import read_scan
from derain.scan import Array, Scan
from derain.views.return_columns import stated_returns
from derain.views.returns import pair_returns

from ..two_returns import Recording


def with_columns(recording: Recording, **columns: Array) -> Scan:
    return Scan(recording.xyz, fields=columns)


def numbers(recording: Recording) -> NDArray[np.uint8]:
    """1 for the first return of a ray, 2 for the second."""
    _, _, farther = recording.truth()
    return (1 + farther).astype(np.uint8)


def of_las(recording: Recording) -> dict[str, Array]:
    counts = (1 + recording.two).astype(np.uint8)
    return {"return_number": numbers(recording), "number_of_returns": counts}


def of_las_bits(recording: Recording) -> dict[str, Array]:
    counts = (1 + recording.two).astype(np.uint8)
    flags = np.zeros(len(counts), np.uint8)
    return {"bit_fields": numbers(recording) | counts << 4, "classification_flags": flags}


def of_old_las_bits(recording: Recording) -> dict[str, Array]:
    counts = (1 + recording.two).astype(np.uint8)
    return {"bit_fields": numbers(recording) | counts << 3 | 0b01000000}


def of_kinds(recording: Recording, *kinds: int) -> dict[str, Array]:
    """One of the first two for the first return, of the next two for the second, or the only."""
    first, second = (np.where(recording.ray % 2, *two) for two in (kinds[:2], kinds[2:4]))
    kind = np.where(numbers(recording) == 2, second, first)
    return {"return_type": np.where(recording.two, kind, kinds[4]).astype(np.uint8)}


def of_nebula(recording: Recording) -> dict[str, Array]:
    return of_kinds(recording, 4, 9, 10, 5, 6)


def of_autoware(recording: Recording) -> dict[str, Array]:
    return of_kinds(recording, 3, 5, 6, 4, 7)


def of_livox(recording: Recording) -> dict[str, Array]:
    return {"tag": (numbers(recording) - 1 << 4 | recording.ray % 16).astype(np.uint8)}


def of_echoes(recording: Recording) -> dict[str, Array]:
    return {"Echo": numbers(recording).astype(np.float32)}


STATED = [of_las, of_las_bits, of_old_las_bits, of_nebula, of_autoware, of_livox, of_echoes]


@pytest.mark.parametrize("columns", STATED)
def test_the_columns_of_a_file_agree_with_directions(columns) -> None:
    recording = Recording(1)
    scan = with_columns(recording, **columns(recording))
    by_directions = pair_returns(Scan.of(recording.xyz))
    stated = pair_returns(scan)
    assert stated.found_by in {name.lower() for name in scan.fields}
    for name in ("nearer", "farther", "partner"):
        np.testing.assert_array_equal(getattr(stated, name), getattr(by_directions, name))


@pytest.mark.parametrize("columns", STATED)
def test_a_return_whose_partner_is_not_in_the_file_is_known_by_its_column(columns) -> None:
    recording = Recording(2)
    _, nearer, farther = recording.truth()
    whole = with_columns(recording, **columns(recording))
    # Of every ray with two returns one is left out: of some the nearer, of the others the farther.
    kept = ~np.where(recording.ray % 3 == 0, nearer, farther)
    returns = pair_returns(whole.take(kept))
    assert (returns.partner == -1).all()
    np.testing.assert_array_equal(returns.farther, farther[kept])
    knows_of_more = columns not in (of_livox, of_echoes)
    np.testing.assert_array_equal(returns.nearer, nearer[kept] & knows_of_more)


def test_the_columns_of_a_file_go_before_directions() -> None:
    recording = Recording(3)
    partner, _, _ = recording.truth()
    columns = of_las(recording)
    single = recording.ray % 2 == 0
    columns["number_of_returns"][single] = columns["return_number"][single] = 1
    returns = pair_returns(with_columns(recording, **columns))
    np.testing.assert_array_equal(returns.partner, np.where(single, -1, partner))
    assert not (returns.nearer | returns.farther)[single].any()


def test_a_column_that_counts_inwards_is_taken_the_other_way_round() -> None:
    recording = Recording(4)
    _, nearer, farther = recording.truth()
    columns = of_las(recording)
    two = recording.two
    columns["return_number"][two] = 3 - columns["return_number"][two]
    gone = farther & (recording.ray % 2 == 0)  # of these rays only the nearer is left
    returns = pair_returns(with_columns(recording, **columns).take(~gone))
    np.testing.assert_array_equal(returns.nearer, nearer[~gone])
    np.testing.assert_array_equal(returns.farther, farther[~gone])


@pytest.mark.parametrize(
    "column",
    [
        {"return_number": np.ones(10, np.uint8), "number_of_returns": np.ones(10, np.uint8)},
        {"return_number": np.zeros(10), "number_of_returns": np.full(10, np.nan)},
        {"return_type": np.full(10, 3, np.uint8)},
        {"return_type": np.arange(10) % 3},
        {"tag": np.full(10, 0b101, np.uint8)},
        {"bit_fields": np.full(10, 0b01001001, np.uint8)},
        {"bit_fields": np.full(10, 0b10010001)},
        {"tag": np.linspace(0, 99, 10)},
        {"echo": np.full(10, np.inf)},
        {"range": np.ones(10), "range2": np.zeros(10)},
        {"range": np.zeros(10), "range2": np.ones(10)},
    ],
)
def test_a_column_without_information_is_ignored(column) -> None:
    scan = Scan(np.random.default_rng(0).normal(5, 1, (10, 3)).astype(np.float32), fields=column)
    assert stated_returns(scan) is None
    returns = pair_returns(scan)
    assert not returns.dual
    assert not (returns.nearer | returns.farther).any()
    assert (returns.partner == -1).all()


def test_a_second_return_in_the_row_of_the_first_is_known_by_its_range() -> None:
    xyz = np.array([[10, 0, 0], [0, 20, 0], [0, 0, 5], [7, 0, 0]], np.float32)
    columns = {"range": np.array([9990, 20_000, 5000, 0]), "range2": np.array([29_970, 4000, 0, 9])}
    returns = pair_returns(Scan(xyz, fields=columns))
    assert returns.found_by == "range2"
    assert returns.nearer.tolist() == [True, False, False, False]
    assert returns.farther.tolist() == [False, True, False, False]
    assert (returns.partner == -1).all()


def test_ranges_that_no_sensor_measures_are_no_second_return() -> None:
    columns = {"range": np.array([1e-300, 1, np.nan, 1]), "range2": np.array([1e300, 1e9, 1, 1.5])}
    returns = pair_returns(Scan(np.full((4, 3), 9, np.float32), fields=columns))
    assert returns.nearer.tolist() == [False, False, False, True]
    assert not returns.farther.any()


def test_ousters_second_returns_lie_behind_the_first_or_in_front(shared) -> None:
    scan = read_scan(shared / "data" / "clean" / "ouster_os0_32_dual.npz")
    first, second = (scan.fields[name].astype(np.int64) for name in ("range", "range2"))
    returns = pair_returns(scan)
    both = scan.valid & (second > 0)
    assert both.sum() > 50
    np.testing.assert_array_equal(returns.nearer, both & (second > first))
    np.testing.assert_array_equal(returns.farther, both & (second < first))


def test_the_types_of_the_velodyne_file_follow_from_its_geometry(shared) -> None:
    scan = read_scan(shared / "data" / "clean" / "velodyne_vlp16_dual.pcd")
    returns = pair_returns(scan)
    # Of its driver, "last" is the nearer of two: all that lie in one direction show it.
    np.testing.assert_array_equal(returns.nearer, np.isin(scan.fields["return_type"], (5, 10)))
    paired = np.flatnonzero(returns.partner >= 0)
    nearer = scan.range[returns.partner[paired]] > scan.range[paired]
    np.testing.assert_array_equal(nearer, returns.nearer[paired])
