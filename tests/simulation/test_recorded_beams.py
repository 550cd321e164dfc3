"""The beams behind recorded scans, against sensors whose beams are known."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.files import read_scan
from derain.scan import Bools, Floats, Scan
from derain.simulation.recorded_beams import RecordedBeams, find_beams, in_hull
from derain.simulation.sensor import Sensor

# Half a step off, so that beams lie in the middle of the columns of a grid from -180 to 180.
HALF_STEP = 180 / 512
SENSOR = Sensor(
    azimuth=(-180 - HALF_STEP, 180 - HALF_STEP), inclination=(-20, 10), rows=32, columns=512
)
# Across the circle that a rosette fills, degrees.
FIELD_OF_VIEW = 70.0

ORGANISED = ("ouster_os0_32_dual.npz", "pandaset_pandar64.pcd")


def degrees_between(first: Floats, second: Floats) -> Floats:
    return np.degrees(2 * np.arcsin(np.linalg.norm(first - second, axis=1) / 2))


def beams_of(scan: Scan) -> RecordedBeams:
    return find_beams(scan, np.random.default_rng(0))


def recording(returned: Bools, nothing: float) -> Scan:
    """A scan of a sensor whose rows lag behind by steps of half a degree, as lasers are mounted."""
    distance = np.random.default_rng(1).uniform(3, 60, len(returned))
    xyz = np.where(returned[:, None], lagging() * distance[:, None], nothing)
    return Scan(xyz.astype(np.float32), shape=(SENSOR.rows, SENSOR.columns))


def lagging() -> Floats:
    beams = SENSOR.beams().reshape(SENSOR.rows, SENSOR.columns, 3)
    lag = np.radians(0.5 * (np.arange(SENSOR.rows) % 4))[:, None]
    x = beams[..., 0] * np.cos(lag) - beams[..., 1] * np.sin(lag)
    y = beams[..., 0] * np.sin(lag) + beams[..., 1] * np.cos(lag)
    return np.stack([x, y, beams[..., 2]], axis=-1).reshape(-1, 3)


@pytest.mark.parametrize("nothing", [np.nan, 0.0])
def test_empty_cells_of_an_organised_scan_look_where_their_row_and_column_look(nothing) -> None:
    returned = np.random.default_rng(2).random(SENSOR.rows * SENSOR.columns) < 0.6
    scan = recording(returned, nothing)
    beams = beams_of(scan)
    assert (beams.row == np.arange(len(scan))).all()
    assert (beams.returned == returned).all()
    assert degrees_between(beams.direction, lagging()).max() < 0.01


def test_cells_of_an_empty_row_or_column_have_no_direction() -> None:
    returned = np.ones((SENSOR.rows, SENSOR.columns), bool)
    returned[5], returned[:, 7] = False, False
    known = np.isfinite(beams_of(recording(returned.ravel(), np.nan)).direction).all(axis=1)
    assert (known == returned.ravel()).all()


def test_every_return_of_an_unorganised_scan_is_a_beam_of_its_own() -> None:
    returned = np.random.default_rng(3).random(SENSOR.rows * SENSOR.columns) < 0.8
    organised = recording(returned, np.nan)
    # Two returns in one direction, and returns in any order.
    rows = np.random.default_rng(4).permutation(np.append(np.flatnonzero(returned), [0] * 3))
    scan = Scan(np.nan_to_num(organised.xyz[rows], nan=1.0))
    beams = beams_of(scan)
    assert (beams.row[: len(scan)] == np.arange(len(scan))).all()
    assert beams.returned[: len(scan)].all()
    own = beams.direction[: len(scan)] * np.linalg.norm(scan.xyz, axis=1, keepdims=True)
    assert np.allclose(own, scan.xyz, atol=1e-5)


def test_unreturned_beams_look_where_nothing_returned_and_follow_a_return_of_their_row() -> None:
    returned = np.random.default_rng(5).random(SENSOR.rows * SENSOR.columns) < 0.8
    xyz = (SENSOR.beams() * 20)[returned].astype(np.float32)
    beams = beams_of(Scan(xyz))
    unreturned = ~beams.returned
    assert unreturned.sum() == pytest.approx(np.count_nonzero(~returned), rel=0.05)
    direction, before = beams.direction[unreturned], beams.direction[beams.row[unreturned]]
    cosine = direction @ SENSOR.beams()[~returned].T
    assert np.degrees(np.arccos(np.clip(cosine.max(axis=1), -1, 1))).max() < HALF_STEP

    # A return that shares its pixel with another has left one of its own empty.
    doubled = beams_of(Scan(np.concatenate([xyz, xyz[:1000]])))
    assert np.count_nonzero(~doubled.returned) == unreturned.sum() - 1000
    same_row = np.isclose(np.arcsin(direction[:, 2]), np.arcsin(before[:, 2]), atol=2e-3)
    assert same_row.mean() > 0.98  # the first of a row has no return before it
    assert degrees_between(direction, before)[same_row].mean() < 2


def rosette(shots: int, about: float = 0.0) -> Floats:
    """Unit vectors of a sensor that fills a circle around an azimuth in degrees with a rosette."""
    half = FIELD_OF_VIEW / 2
    field = {"azimuth": (about - half, about + half), "inclination": (-half, half)}
    return Sensor(pattern="rosette", rows=1, columns=shots, **field).beams()


def off_axis(direction: Floats, about: float) -> Floats:
    """How far unit vectors point from the axis of a rosette, float64 (N,), degrees."""
    axis = np.radians(about)
    cosine = direction @ [np.cos(axis), np.sin(axis), 0]
    return np.degrees(np.arccos(np.clip(cosine, -1, 1)))


@pytest.mark.parametrize("about", [0.0, 180.0])
def test_a_rosette_has_no_beams_outside_its_circle(about) -> None:
    direction = rosette(24_000, about)
    generator = np.random.default_rng(8)
    returned = generator.random(len(direction)) < 0.8
    distance = generator.uniform(3, 60, len(direction))[:, None]
    beams = beams_of(Scan((direction * distance)[returned].astype(np.float32)))
    unreturned = beams.direction[~beams.returned]
    # All over the circle, out to its edge and no farther.
    assert len(unreturned) >= np.count_nonzero(~returned)
    assert FIELD_OF_VIEW / 2 - 1 < off_axis(unreturned, about).max() <= FIELD_OF_VIEW / 2
    for corner in (unreturned[:, 2] > 0.4, unreturned[:, 2] < -0.4):
        assert corner.sum() > 100


def test_cells_give_no_beams_that_are_not_in_rows_and_columns() -> None:
    returned = np.random.default_rng(9).random(24_000) < 0.8
    xyz = np.where(returned[:, None], rosette(24_000) * 20, np.nan).astype(np.float32)
    beams = beams_of(Scan(xyz, shape=(100, 240)))
    assert (np.isfinite(beams.direction).all(axis=1) == returned).all()


@pytest.mark.parametrize("name", ORGANISED)
def test_directions_of_real_returns_are_found_when_they_are_hidden(name, shared) -> None:
    scan = read_scan(shared / "data" / "clean" / name)
    hidden = scan.valid & (np.random.default_rng(7).random(len(scan)) < 0.3)
    xyz = scan.xyz.copy()
    xyz[hidden] = np.nan
    found = beams_of(Scan(xyz, shape=scan.shape)).direction[hidden]
    truth = scan.xyz[hidden] / np.linalg.norm(scan.xyz[hidden], axis=1, keepdims=True)
    error = degrees_between(found, truth)
    assert np.median(error) < 0.1
    assert np.percentile(error, 95) < 0.4


@pytest.mark.parametrize("name", ORGANISED)
def test_a_scan_without_its_cells_has_no_more_beams_than_with_them(name, shared) -> None:
    scan = read_scan(shared / "data" / "clean" / name)
    found = beams_of(Scan(scan.xyz[scan.valid]))
    unreturned = np.count_nonzero(~scan.valid)
    # Pandar64 has uneven beams: even rows as fine as the closest of them are 208, not 64.
    assert 0.4 * unreturned <= np.count_nonzero(~found.returned) <= unreturned


# On a lattice, so that corners coincide, lie one above the other and three in a line.
lattice = st.tuples(st.integers(-4, 4), st.integers(-4, 4))
polygons = st.lists(lattice, min_size=1, max_size=12)


def as_columns(points: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.array(points, float).T
    return x, y


@given(polygons, lattice)
def test_a_place_is_outside_if_a_line_parts_it_from_every_point(points, place) -> None:
    # Hulls of such points have edges in these directions only; so do the lines that part.
    normals = np.stack(np.meshgrid(np.arange(-8, 9), np.arange(-8, 9))).reshape(2, -1)
    parted = ((np.array(points) - place) @ normals > 0).all(axis=0).any()
    assert in_hull(as_columns(points), as_columns([place])).all() == (not parted)
