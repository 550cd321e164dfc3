"""Scans that are not what one sensor sees in metres are warned of, and no others."""

from functools import cache

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.files import read_scan
from derain.filters import DROR, FilterDerainer
from derain.models.outdet import OutDet
from derain.scan import LARGEST_COORDINATE, Floats, Scan
from derain.simulation.sensor import unit_vectors
from derain.views.one_viewpoint import (
    FEWEST_RETURNS,
    crowding_far_off,
    range_step,
    rays_near_axes,
    viewpoint_issues,
)

# Where the sensor is above the road, metres.
HEIGHT = 1.8

Points = Floats


def rays(beams: int, steps: int, sector: float = 360.0, opening: float = 30.0) -> Points:
    """Directions of a sensor that looks ahead, 5 degrees down in the middle, (beams · steps, 3)."""
    inclination = np.linspace(-opening / 2, opening / 2, beams) - 5
    azimuth = np.linspace(-sector / 2, sector / 2, steps, endpoint=sector < 360)
    return unit_vectors(azimuth, inclination[:, None])


def street(directions: Points, x: float = 0.0) -> Points:
    """What rays meet of a street, seen from a place on it, (N, 3) metres in the sensor's frame.

    There are a road, two walls far off to the sides, and hundreds of trees before them.
    """
    generator = np.random.default_rng(0)
    poles = np.stack([generator.uniform(-60, 60, 600) - x, generator.uniform(-60, 60, 600)])
    poles = poles[:, np.abs(poles[1]) > 2]
    with np.errstate(divide="ignore"):
        range_ = np.minimum(70 / np.abs(directions[:, 1]), 120.0)
        down = directions[:, 2] < 0
        range_[down] = np.minimum(range_[down], -HEIGHT / directions[down, 2])
    horizontal = np.linalg.norm(directions[:, :2], axis=1)
    azimuth = np.arctan2(directions[:, 1], directions[:, 0]).round(9)
    azimuths, of_azimuth = np.unique(azimuth, return_inverse=True)
    ahead = np.stack([np.cos(azimuths), np.sin(azimuths)], axis=1)
    nearest = np.full(len(ahead), 1000.0)
    for pole in poles.T:
        along, aside = ahead @ pole, ahead @ (pole[1], -pole[0])
        met = (np.abs(aside) < 0.3) & (along > 0)
        near = along[met] - np.sqrt(0.09 - aside[met] ** 2)
        nearest[met] = np.minimum(nearest[met], near)
    to_pole = nearest[of_azimuth] / horizontal
    low = to_pole * directions[:, 2] < 5 - HEIGHT
    range_ = np.where(low, np.minimum(range_, to_pole), range_)
    return directions * range_[:, None]


def kinds(points: Points) -> list[str]:
    return [issue.kind for issue in viewpoint_issues(Scan.of(points))]


SKYWARD = rays(64, 1024) @ [[0.8, 0, 0.6], [0, 1, 0], [-0.6, 0, 0.8]]
SKYWARD = SKYWARD[SKYWARD[:, 2] > 0]


@pytest.fixture(scope="module")
def spinning() -> Points:
    return street_from(0.0)


@cache
def street_from(x: float) -> Points:
    """What the sensor sees from a place of its drive."""
    return street(rays(64, 1024), x)


def drive(scans: int, step: float) -> Points:
    """Scans of a sensor that drives along the street, merged in the frame of the last."""
    places = step * np.arange(scans)
    seen = [street_from(place) + np.array([place - places[-1], 0, 0]) for place in places]
    return np.concatenate(seen)


@pytest.mark.parametrize(
    "directions",
    [
        *(rays(64, 1024), rays(16, 1800), rays(256, 500, 120, 25), rays(32, 2048, opening=90)),
        rays(4, 1000, opening=3.2),
    ],
)
def test_what_one_sensor_sees_is_not_odd(directions) -> None:
    assert kinds(street(directions)) == []


def test_nor_are_the_rays_of_a_rosette_which_crowd_where_it_looks() -> None:
    generator = np.random.default_rng(0)
    off, turn = np.radians([generator.uniform(0, 30, 40_000), generator.uniform(0, 360, 40_000)])
    aside, up = np.sin(off) * [np.cos(turn), np.sin(turn)]
    assert kinds(street(np.stack([np.cos(off), aside, up], axis=1))) == []


def test_nor_are_two_returns_of_every_ray_in_dense_snow(spinning) -> None:
    share = np.random.default_rng(0).uniform(0.05, 0.9, (len(spinning), 1))
    both = np.concatenate([spinning, spinning * share, spinning])  # and one of them twice
    assert kinds(both) == []


@pytest.mark.parametrize("factor", [1000, 100, 0.001, 1 / 200, 0.01, 0.1, 3.28084])
def test_units_show_in_how_far_points_and_the_ground_are(spinning, factor) -> None:
    assert kinds(spinning * factor) == ["coordinates not in metres"]


@pytest.mark.parametrize(
    ("directions", "height"), [(rays(64, 1024), 0.4), (rays(64, 1024), 4.0), (SKYWARD, 7.0)]
)
def test_a_sensor_on_a_robot_or_a_lorry_and_one_that_sees_no_ground_are_not_odd(
    directions, height
) -> None:
    assert kinds(street(directions) * height / HEIGHT) == []


@pytest.mark.parametrize("origin", [(400_000, 500_000, 200), (700, 100, 0), (0, 0, 300)])
def test_points_far_from_the_origin_are_those_of_a_map(spinning, origin) -> None:
    assert kinds(spinning + origin) == ["coordinates of a map"]


def test_points_beyond_all_sensors_are_nearly_none_and_perhaps_a_map(spinning) -> None:
    (issue,) = viewpoint_issues(Scan.of(spinning + np.array([400_000, 5_400_000, 200])))
    assert issue.kind == "almost empty"
    assert "coordinates of a map" in issue.detail


def test_a_few_points_beyond_all_sensors_are_damage_and_no_map(spinning) -> None:
    damaged = spinning.copy()
    damaged[:1000] = 2 * LARGEST_COORDINATE
    assert kinds(damaged) == []


# Rays of a scanner of the plane z = 0.
FLAT = rays(1, 1000) * (1, 1, 0)


@pytest.mark.parametrize(
    "directions",
    [
        FLAT,
        rays(1, 1000),
        rays(1, 1000, sector=180),
        FLAT @ [[0.8, 0, -0.6], [0, 1, 0], [0.6, 0, 0.8]],
    ],
    ids=["plane", "cone", "half a cone", "tilted plane"],
)
def test_a_single_beam_is_one_plane_or_cone(directions) -> None:
    assert kinds(street(directions)) == ["a single beam"]


@pytest.mark.parametrize(("scans", "step"), [(10, 1.3), (5, 10.0)])
def test_scans_merged_into_a_map_are_seen_from_several_places(scans, step) -> None:
    merged = drive(scans, step)
    assert kinds(merged) == ["points of several viewpoints"]
    cells = np.floor(merged / 0.2).astype(int) @ (1, 10_000, 10_000**2)
    voxels = np.unique(cells, return_index=True)[1]
    assert kinds(merged[voxels]) == ["points of several viewpoints"]


def tower(turned: float, x: float) -> Points:
    """What a sensor sees inside a round tower, turned by some radians, x metres off its centre."""
    inclination, azimuth = np.meshgrid(
        np.radians(np.arange(-10, 10)), np.arange(1800) * np.pi / 900
    )
    azimuth = (azimuth + turned).ravel()
    range_ = np.sqrt(20**2 - (x * np.sin(azimuth)) ** 2) - x * np.cos(azimuth)
    up = range_ * np.tan(inclination.ravel())
    return np.stack([range_ * np.cos(azimuth), range_ * np.sin(azimuth), up], axis=1)


def test_scans_of_a_moving_sensor_put_together_without_poses_are_odd() -> None:
    assert kinds(tower(0, 0)) == []
    together = np.concatenate([tower(0, 0), tower(0.001, 1.3)])
    assert kinds(together) == ["points of several viewpoints"]


def test_a_sensor_that_stands_sees_from_one_place_however_often(spinning) -> None:
    noise = np.random.default_rng(0).normal(1, 0.001, (10, *spinning.shape))
    assert kinds((spinning * noise).reshape(-1, 3)) == []


def test_near_walls_of_noisy_ranges_are_seen_from_one_place() -> None:
    directions = rays(32, 900)
    walls = np.minimum(1.5 / np.abs(directions[:, :2]).max(axis=1), 20)
    noisy = walls + np.random.default_rng(0).normal(0, 0.03, len(walls))
    assert kinds(directions * noisy[:, None]) == []


def crowding_by_hand(scan: Scan) -> float:
    """The same number, point after point."""
    x, y, z = scan.xyz.T.astype(np.float64)
    from_axis = np.abs((np.degrees(np.arctan2(y, x)) + 22.5) % 45 - 22.5)
    near = np.flatnonzero(np.tan(np.radians(from_axis)) < 0.02)
    cells: dict[tuple[int, ...], int] = {}
    found = []
    for number in near:
        azimuth = np.degrees(np.arctan2(y[number], x[number]))
        inclination = np.degrees(np.arctan2(z[number], np.hypot(x[number], y[number])))
        range_ = float(np.sqrt(x[number] ** 2 + y[number] ** 2 + z[number] ** 2))
        surface = int(np.log(range_) // np.log(1.25))
        cell = (round(azimuth / 0.1), round(inclination / 0.1), surface)
        cells[cell] = cells.get(cell, 0) + 1
        found.append((range_, cell))
    quarters = np.array_split([cells[cell] for _, cell in sorted(found)], 4)
    return float(max(map(np.mean, quarters)) / quarters[0].mean())


def test_crowding_is_that_of_counting_point_after_point() -> None:
    generator = np.random.default_rng(1)
    directions = rays(8, 400)[generator.integers(0, 3200, 20_000)]
    range_ = 40 * generator.uniform(0.1, 1, (20_000, 1)) ** 0.3  # most are far off
    scan = Scan.of(directions * range_)
    crowding = crowding_far_off(rays_near_axes(scan))
    assert crowding == pytest.approx(crowding_by_hand(scan), rel=0.01)
    assert crowding > 1.5


def test_the_range_step_is_that_of_the_farthest_returns_of_neighbouring_rays() -> None:
    azimuth, inclination = np.meshgrid(np.arange(300) * 0.2, [-10.0, 0.0])
    far = np.where(np.arange(300) % 3 == 0, 10.0, 11.0) * np.array([[1.0], [2.0]])
    both = [np.tile(each.ravel(), 2) for each in (azimuth, inclination)]
    rays = np.stack([*both, np.concatenate([far.ravel(), far.ravel() / 3])])
    # By a metre at 10 m, and by two at 20 m, less 5 cm of noise.
    assert 0.0949 < range_step(rays) < 0.0976
    assert range_step(rays[:, :100]) == 0


@pytest.mark.parametrize("points", [1, FEWEST_RETURNS - 1])
def test_few_points_are_almost_none(spinning, points) -> None:
    assert kinds(spinning[:points]) == ["almost empty"]
    nothing = np.full((5000, 3), np.nan)
    assert kinds(np.concatenate([spinning[:points], nothing])) == ["almost empty"]
    assert kinds(np.concatenate([spinning[::1000], np.zeros((7000, 3))])) == ["almost empty"]


def test_rays_without_a_return_that_were_moved_with_their_frame_are_named(spinning) -> None:
    nothing, moved = np.zeros((len(spinning) // 20, 3)), np.array([3.0, 0, 1])
    assert kinds(np.concatenate([spinning, nothing])) == []  # they are at the origin
    points = np.concatenate([nothing, spinning]) + moved
    (issue,) = viewpoint_issues(Scan.of(points))
    assert issue.kind == "many points at one position"
    assert f"{len(nothing):,} points lie at (3, 0, 1) m" in issue.detail
    assert kinds(np.repeat(spinning, 4, axis=0)) == []


def test_a_scan_of_which_no_row_can_be_judged_is_almost_empty() -> None:
    assert kinds(np.zeros((0, 3))) == []  # a warning of its own says that it has no rows
    for points in (np.zeros((500, 3)), np.full((500, 3), np.nan)):
        assert kinds(points) == ["almost empty"]


def test_every_warning_names_a_remedy(spinning) -> None:
    remedies = {
        "divide millimetres": spinning * 1000,
        "have to be in metres": spinning / 1000,
        "subtract the sensor's position": spinning + 4e5,
        "multiply feet": spinning * 3.28,
        "clean scans one by one": drive(10, 2.0),
        "made for sensors of many beams": street(rays(1, 1000)),
        "may be covered": spinning[:9],
    }
    for remedy, points in remedies.items():
        (issue,) = viewpoint_issues(Scan.of(points))
        assert remedy in issue.detail


def test_networks_and_filters_warn_of_it(spinning) -> None:
    scan = Scan.of(np.column_stack([spinning * 1000, np.resize(np.arange(90.0), len(spinning))]))
    derainer = FilterDerainer(DROR(), threads=1)
    spec = OutDet().spec_for(load_card("wads"))
    for found in (spec.issues(scan), derainer.issues(derainer.judge(scan))):
        assert [issue.kind for issue in found] == ["coordinates not in metres"]


@pytest.fixture(scope="module")
def real(shared) -> dict[str, Scan]:
    """Every real scan that there is."""
    data = shared / "data"
    folders = ("clean", "snowykitti/velodyne", "wads", "wads/drive/velodyne")
    found = [path for folder in folders for path in sorted((data / folder).glob("*.*"))]
    return {path.name: read_scan(path) for path in found if path.suffix in (".bin", ".npz", ".pcd")}


def test_no_real_scan_is_odd(real) -> None:
    assert len(real) >= 30
    assert not {name: odd for name, scan in real.items() if (odd := [*viewpoint_issues(scan)])}


@pytest.mark.parametrize(
    ("change", "kind"),
    [
        (lambda xyz: xyz * 1000, "coordinates not in metres"),
        (lambda xyz: xyz / 1000, "coordinates not in metres"),
        (lambda xyz: xyz / 10, "coordinates not in metres"),
        (lambda xyz: xyz + np.float32([4e5, 5e5, 200]), "coordinates of a map"),
        (lambda xyz: xyz * np.float32([1, 1, 1e-4]), "a single beam"),
        (lambda xyz: xyz[:20], "almost empty"),
    ],
)
def test_every_real_scan_is_once_it_is_changed(real, change, kind) -> None:
    for name, scan in real.items():
        changed = Scan(change(scan.xyz[scan.valid]))
        (issue,) = viewpoint_issues(changed)
        assert kind in issue.kind, name


def test_real_scans_in_feet_are_odd_unless_their_sensor_is_low(real) -> None:
    changed = {name: Scan(scan.xyz[scan.valid] * np.float32(3.28)) for name, scan in real.items()}
    missed = {name for name, scan in changed.items() if not [*viewpoint_issues(scan)]}
    assert missed == {"hesai_at128_front.pcd", "velodyne_vlp16_dual.pcd"}


@pytest.mark.parametrize("scans", [4, 10])
@pytest.mark.parametrize("step", [1.33, 0.0], ids=["by poses", "without poses"])
def test_real_scans_of_a_drive_are_odd_once_merged(real, scans, step) -> None:
    drive = [scan for name, scan in sorted(real.items()) if name.startswith("0422")]
    assert len(drive) == 20
    parts = [scan.xyz[scan.valid] + np.float32([step * n, 0, 0]) for n, scan in enumerate(drive)]
    (issue,) = viewpoint_issues(Scan(np.concatenate(parts[:scans])))
    assert issue.kind == "points of several viewpoints"
