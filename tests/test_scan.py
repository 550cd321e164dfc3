"""A scan keeps its rows, and knows of each whether it can be judged."""

import math
import warnings
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.errors import InputError
from derain.scan import FEWEST_ALIKE, Scan

# What separates a valid point from one that is not, and its neighbours among the float32.
SPECIAL = [0.0, -0.0, -1.0, 1e-30, 1e6, 1000000.0625, 1e7, 10000001.0, 3e38, math.nan, math.inf]
special = st.sampled_from([*SPECIAL, -math.inf])
rows_of_four = hnp.arrays(
    np.float32,
    st.tuples(st.integers(0, 8), st.just(4)),
    elements=special | st.floats(-100, 100, width=32),
)


def full_scan() -> Scan:
    """Six points with everything a scan can have."""
    rng = np.random.default_rng(0)
    return Scan(
        xyz=rng.normal(size=(6, 3)).astype(np.float32),
        intensity=np.arange(6, dtype=np.float32),
        label=np.arange(6) * 10,
        radar=np.arange(6) % 2 == 0,
        fields={"ring": np.arange(6, dtype=np.uint16), "time": rng.normal(size=6)},
        shape=(2, 3),
        name="full.pcd",
        header="of the file",
    )


def can_be_judged(point: list[float], intensity: float | None) -> bool:
    values = point if intensity is None else [*point, intensity]
    return (
        all(math.isfinite(value) for value in values)
        and all(abs(coordinate) <= 1e6 for coordinate in point)
        and (intensity is None or abs(intensity) <= 1e7)
        and any(coordinate != 0 for coordinate in point)
        and any(value != -1 for value in values)
    )


@given(rows_of_four)
def test_valid_is_computed_as_row_by_row(points) -> None:
    rows = points.tolist()
    # Where not one intensity is a number, the column decides nothing.
    known = any(abs(row[3]) <= 1e7 for row in rows)
    expected = [can_be_judged(row[:3], row[3] if known else None) for row in rows]
    blank = [can_be_judged(row[:3], None) for row in rows]
    scan = Scan.of(points)
    assert scan.valid.tolist() == expected
    assert Scan.of(points[:, :3]).valid.tolist() == blank
    lacking = [place and not both for place, both in zip(blank, expected, strict=True)]
    assert scan.lacks_intensity.tolist() == lacking


@given(
    st.lists(special | st.just(7.0), min_size=1, max_size=4),
    st.integers(1, 2 * FEWEST_ALIKE),
    st.sampled_from([0, 1, FEWEST_ALIKE - 1, FEWEST_ALIKE]),
)
def test_intensity_was_measured_where_it_differs_or_the_points_are_few(
    values, points, blank
) -> None:
    xyz = np.ones((points, 3), np.float32)
    xyz[:blank] = np.nan
    scan = Scan(xyz, np.resize(np.array(values, np.float32), points))
    known = [value for value in scan.intensity.tolist() if abs(value) <= 1e7]
    seen = [
        value for value, valid in zip(scan.intensity.tolist(), scan.valid, strict=True) if valid
    ]
    measured = known and (len(seen) < FEWEST_ALIKE or len(set(seen)) > 1)
    assert (scan.measured_intensity is not None) == bool(measured)
    assert (scan.channel("intensity") is None) == (scan.measured_intensity is None)
    if measured:
        assert scan.measured_intensity is scan.intensity


def test_intensities_of_another_unit_leave_the_columns_of_the_file() -> None:
    scan = full_scan()
    scan.intensity[0] = -1  # the mark of a cell without a return
    scaled = scan.with_intensity_times(255)
    np.testing.assert_array_equal(scaled.intensity, [-1, 255, 510, 765, 1020, 1275])
    assert scaled.fields is scan.fields
    assert scan.with_intensity_times(1) is scan
    for factor in (0, -1, math.nan, math.inf):
        with pytest.raises(InputError, match="Give a number above 0"):
            scan.with_intensity_times(factor)


@given(rows_of_four)
def test_range_is_the_distance_from_the_sensor(points) -> None:
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        distance = Scan.of(points).range
    expected = np.array([math.sqrt(x * x + y * y + z * z) for x, y, z, _ in points.tolist()])
    with np.errstate(over="ignore"):
        np.testing.assert_allclose(distance, expected.astype(np.float32), rtol=1e-6)


def test_an_array_becomes_a_scan_of_its_first_four_columns() -> None:
    points = np.arange(15.0).reshape(3, 5)
    scan = Scan.of(points, name="numbers")
    np.testing.assert_array_equal(scan.xyz, points[:, :3])
    np.testing.assert_array_equal(scan.intensity, points[:, 3])
    assert scan.xyz.dtype == np.float32
    assert (len(scan), scan.name) == (3, "numbers")
    assert Scan.of(scan) is scan
    assert Scan.of(points[:, :3]).intensity is None


@pytest.mark.parametrize("dtype", [np.float64, np.int64])
def test_what_a_masked_array_masks_cannot_be_judged(dtype) -> None:
    points = np.ma.masked_less(np.arange(1, 13, dtype=dtype).reshape(3, 4), 5)
    for scan in (Scan.of(points), Scan(points[:, :3], points[:, 3])):
        assert scan.valid.tolist() == [False, True, True]


@pytest.mark.parametrize("shape", [(0,), (4,), (5, 2), (2, 4, 4), (), (4, 100)])
def test_an_array_that_is_not_rows_of_points_is_refused(shape) -> None:
    with pytest.raises(InputError, match=r"mine: points have shape .*\. Give an array"):
        Scan.of(np.zeros(shape), name="mine")


def test_what_is_no_array_of_points_is_refused_with_what_to_give_instead() -> None:
    structured = np.zeros(5, [("x", "f4"), ("y", "f4")])
    for given_, hint in (
        ("drive/scan.bin", r"drive/scan\.bin: .*derain\.read_scan"),
        (Path("drive/scan.bin"), r"drive/scan\.bin: .*derain\.read_scan"),
        (structured, "shape"),
        (None, "shape"),
        ([[1, 2, 3], [4]], "array"),
        (np.array([["a", "b", "c"]]), "xyz"),
        (np.ones((5, 4), complex), "xyz cannot be converted .it is of complex numbers"),
    ):
        with pytest.raises(InputError, match=hint):
            Scan.of(given_)


def test_every_array_that_a_scan_is_given_is_copied() -> None:
    given_ = {
        "xyz": np.ones((5, 3), np.float32),
        "intensity": np.ones(5, np.float32),
        "label": np.ones(5, np.int64),
        "radar": np.ones(5, bool),
    }
    scan = Scan(**given_, fields={"ring": (ring := np.ones(5))})
    labelled = scan.with_label(label := np.ones(5, np.int64))
    for array in (*given_.values(), ring, label):
        array[:] = 0
    for name in given_:
        assert getattr(scan, name).all()
    assert scan.fields["ring"].all()
    assert labelled.label.all()


@pytest.mark.parametrize("dtype", [np.uint32, np.uint16, np.int32, np.uint8, float])
def test_class_ids_of_any_dtype_are_taken_without_the_instances_of_label_files(dtype) -> None:
    instance = 7 << 16 if dtype is np.uint32 else 0
    scan = Scan.of(np.ones((2, 3)))
    label = scan.with_label(np.array([40, instance + 110], dtype)).label
    assert label.dtype == np.int64
    assert label.tolist() == [40, 110]
    assert scan.label is None


@pytest.mark.parametrize("label", [[0.5, 1], [math.nan, 1], ["snow", "rain"]])
def test_class_ids_that_are_not_whole_numbers_are_refused(label) -> None:
    with pytest.raises(InputError, match="array: label"):
        Scan.of(np.ones((2, 3))).with_label(np.array(label))


@pytest.mark.parametrize("column", ["intensity", "label", "radar", "fields"])
def test_a_column_of_another_shape_is_refused(column) -> None:
    short = np.zeros(2)
    columns = {column: {"ring": short} if column == "fields" else short}
    title = "ring" if column == "fields" else column
    with pytest.raises(InputError, match=f"cloud.bin: {title} has shape .2,. for 3 points"):
        Scan(np.zeros((3, 3), np.float32), name="cloud.bin", **columns)
    if column != "fields":
        with pytest.raises(InputError, match=rf"{column} has shape \(3, 1\)"):
            Scan(np.ones((3, 3)), **{column: np.ones((3, 1))})
    with pytest.raises(InputError, match=r"coordinates have shape \(3, 4\)"):
        Scan(np.zeros((3, 4), np.float32))


@given(st.lists(st.integers(0, 5)))
def test_taking_rows_takes_them_of_every_column(rows) -> None:
    scan, taken = full_scan(), full_scan().take(np.array(rows, dtype=np.int64))
    assert len(taken) == len(rows)
    for name in ("xyz", "intensity", "label", "radar"):
        np.testing.assert_array_equal(getattr(taken, name), getattr(scan, name)[rows])
        assert getattr(taken, name).dtype == getattr(scan, name).dtype
    assert set(taken.fields) == set(scan.fields)
    for name, column in scan.fields.items():
        np.testing.assert_array_equal(taken.fields[name], column[rows])
    assert (taken.name, taken.header, taken.shape) == (scan.name, scan.header, None)
    mask = np.isin(np.arange(6), rows)
    np.testing.assert_array_equal(scan.take(mask).xyz, scan.xyz[mask])


def test_the_usual_channels_are_the_scans_own() -> None:
    scan = full_scan()
    for place, axis in enumerate("xyz"):
        np.testing.assert_array_equal(scan.channel(axis), scan.xyz[:, place])
    np.testing.assert_array_equal(scan.channel("range"), scan.range)
    np.testing.assert_array_equal(scan.channel("intensity"), scan.intensity)
    assert scan.channel("radar").tolist() == [1, 0, 1, 0, 1, 0]
    bare = Scan(scan.xyz, fields={"radar": ~scan.radar})
    assert (bare.channel("intensity"), Scan(scan.xyz).channel("radar")) == (None, None)
    assert bare.channel("radar").tolist() == [0, 1, 0, 1, 0, 1]
    assert replace(bare, radar=scan.radar).channel("radar").tolist() == [1, 0, 1, 0, 1, 0]


def test_a_column_of_the_file_is_a_channel_in_upper_and_lower_case() -> None:
    scan = full_scan()
    for name in ("ring", "Ring", "RING"):
        channel = scan.channel(name)
        assert channel.dtype == np.float32
        np.testing.assert_array_equal(channel, np.arange(6))
    assert scan.channel("doppler") is None


def test_what_no_sensor_measures_is_missing_from_a_column() -> None:
    values = np.array([1e7, -1e7, 1.1e7, 1e300, -np.inf, np.nan])
    with warnings.catch_warnings():
        warnings.simplefilter("error")
        channel = Scan(np.ones((6, 3), np.float32), fields={"rcs": values}).channel("rcs")
    assert np.isnan(channel).tolist() == [False, False, True, True, True, True]
    assert channel[:2].tolist() == [1e7, -1e7]


@pytest.mark.parametrize(
    "column", [np.zeros((6, 3)), np.array(list("abcdef")), np.zeros(6, complex)], ids=str
)
def test_a_column_that_is_not_one_number_a_point_is_no_channel(column) -> None:
    assert Scan(np.ones((6, 3), np.float32), fields={"other": column}).channel("other") is None
