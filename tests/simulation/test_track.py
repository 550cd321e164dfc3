"""The ray-cast track against closed forms and a test of every ray with every triangle."""

import math
from types import ModuleType

import numpy as np
import pytest

from derain.simulation import objects, shapes
from derain.simulation.arrays import Floats
from derain.simulation.classes import TrackClass
from derain.simulation.facility import lay_out_facility
from derain.simulation.objects import Surface
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track, backscatter

SENSOR = Sensor(rows=16, columns=40)


def test_flat_ground_lies_where_its_angle_says_and_darkens_with_it(open3d: ModuleType) -> None:
    plane = shapes.rectangle((-500, 500), (-500, 500), 0)
    clear = Track.of([Surface(plane, TrackClass.ROAD, 0.3)]).cast(SENSOR)
    sine = -SENSOR.beams()[:, 2]
    distance = SENSOR.mounting_height / np.where(sine > 0, sine, np.nan)
    hit = distance < SENSOR.maximum_range
    assert 0 < hit.sum() < len(hit)
    assert (clear.returned == hit).all()
    assert np.allclose(clear.range[hit], distance[hit], rtol=1e-4)
    assert np.allclose(clear.reflectivity[hit], 0.3 * sine[hit], rtol=1e-4)
    assert (clear.label[hit] == TrackClass.ROAD).all()
    assert (clear.range[~hit] == SENSOR.maximum_range).all()


def test_rough_ground_is_seen_at_a_grazing_angle(open3d: ModuleType) -> None:
    plane = shapes.rectangle((-500, 500), (-500, 500), 0)
    smooth, rough = (Surface(plane, TrackClass.ROAD, 0.3, roughness) for roughness in (0, 0.6))
    first, second = Track.of([smooth]).cast(SENSOR), Track.of([rough]).cast(SENSOR)
    assert np.array_equal(first.range, second.range)
    sine = -SENSOR.beams()[:, 2][first.returned]
    returned = 0.3 * backscatter(sine, np.full(len(sine), 0.6))
    assert np.allclose(second.reflectivity[first.returned], returned, rtol=1e-4)


def test_casting_finds_the_nearest_of_all_triangles(open3d: ModuleType) -> None:
    generator = np.random.default_rng(0)
    corners = generator.uniform((5, -10, 0), (30, 10, 4), (60, 1, 3))
    triangles = corners + generator.normal(0, 2, (60, 3, 3))
    reflectivity = generator.uniform(0.1, 1, 60)
    clear = Track.of([Surface(triangles, TrackClass.CAR, reflectivity)]).cast(SENSOR)

    # Möller and Trumbore's intersection of every ray with every triangle.
    beams, origin = SENSOR.beams()[:, None], np.array([0, 0, SENSOR.mounting_height])
    first, second = triangles[:, 1] - triangles[:, 0], triangles[:, 2] - triangles[:, 0]
    cross = np.cross(beams, second)
    determinant = (cross * first).sum(-1)
    offset = origin - triangles[:, 0]
    u = (cross * offset).sum(-1) / determinant
    v = (beams * np.cross(offset, first)).sum(-1) / determinant
    distance = (second * np.cross(offset, first)).sum(-1) / determinant
    inside = (u >= 0) & (v >= 0) & (u + v <= 1) & (distance > 0)
    distance = np.where(inside, distance, np.inf)
    nearest, hit = distance.argmin(axis=1), np.isfinite(distance.min(axis=1))

    assert hit.sum() > 50
    assert (clear.returned == hit).all()
    assert np.allclose(clear.range[hit], distance.min(axis=1)[hit], rtol=1e-4)
    normal = np.cross(first, second)
    normal /= np.linalg.norm(normal, axis=1, keepdims=True)
    cosine = np.abs((SENSOR.beams() * normal[nearest]).sum(axis=1))
    assert np.allclose(clear.reflectivity[hit], (reflectivity[nearest] * cosine)[hit], atol=1e-4)


def centres(track: Track, *kinds: TrackClass) -> Floats:
    """Ground positions of the triangles of some classes, float64 (T, 2)."""
    return track.triangles[np.isin(track.label, kinds)].mean(axis=1)[:, :2].astype(np.float64)


def test_the_things_of_the_facility_stand_on_its_road_within_the_stated_distances() -> None:
    for seed in range(10):
        track = lay_out_facility(np.random.default_rng(seed))
        things = centres(
            track, TrackClass.CAR, TrackClass.PEDESTRIAN, TrackClass.BIKE, TrackClass.TARGET
        )
        assert 17 < things[:, 0].min() < things[:, 0].max() < 115
        # The road is turned by 2 degrees at most, and the masts stand on either side of it.
        assert np.abs(things[:, 1]).max() < 3.8 + 112 * np.sin(np.radians(2))
        masts = centres(track, TrackClass.SPRINKLER)
        assert masts[:, 1].min() < things[:, 1].min() < things[:, 1].max() < masts[:, 1].max()


def test_a_second_sensor_sees_the_same_track(open3d: ModuleType) -> None:
    track = lay_out_facility(np.random.default_rng(0))
    first = track.cast(SENSOR)
    track.cast(Sensor(rows=4, columns=10))
    again = track.cast(SENSOR)
    assert np.array_equal(first.range, again.range)
    assert np.array_equal(first.beam, np.arange(16 * 40))


@pytest.mark.parametrize(
    ("make", "size"),
    [
        (objects.car, (5, 2, 2)),
        (objects.bike, (2, 0.5, 2)),
        (objects.pedestrian, (0.5, 0.5, 2)),
        (objects.target, (0.1, 1.3, 2.5)),
        (objects.sprinkler, (1, 3.5, 5.5)),
    ],
)
def test_things_stand_on_the_ground_and_have_everyday_sizes(
    make: object, size: tuple[float, float, float]
) -> None:
    assert callable(make)
    for seed in range(20):
        triangles = make(np.random.default_rng(seed)).triangles
        assert 0 <= triangles[..., 2].min() <= 0.3
        assert (np.ptp(triangles, axis=(0, 1)) < size).all()


def test_foliage_returns_scattered_points_as_weak_as_rain(open3d: ModuleType) -> None:
    bush = objects.foliage((1.0, 1.0, 1.0), 1.0, np.random.default_rng(0)).placed(6, 0)
    sensor = Sensor(azimuth=(-10, 10), rows=60, columns=200)
    clear = Track.of([bush]).cast(sensor)
    assert 20 < clear.returned.sum() < 0.3 * len(clear.returned)
    assert (clear.reflectivity[clear.returned] < 0.02).mean() > 0.3


# Of the light on rough surfaces.
ANGLES = np.radians(np.linspace(0, 89, 90))


def radiance(light: float, eye: float, turn: float, roughness: float) -> float:
    """Radiance over that of Lambert's surface lit straight on, from and to any direction."""
    variance = roughness**2
    facing, grazing = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    between = max(0, math.cos(turn)) * math.sin(max(light, eye)) * math.tan(min(light, eye))
    return math.cos(light) * (facing + grazing * between)


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.3, 0.6, 1.0])
def test_light_comes_back_as_if_the_eye_were_where_the_light_is(roughness: float) -> None:
    returned = backscatter(np.cos(ANGLES), np.full(len(ANGLES), roughness))
    expected = [radiance(angle, angle, 0, roughness) for angle in ANGLES]
    np.testing.assert_allclose(returned, expected, rtol=1e-12)


def test_a_smooth_surface_is_lamberts_to_the_bit() -> None:
    cosine = np.random.default_rng(0).random(1000)
    assert np.array_equal(backscatter(cosine, np.zeros(1000)), cosine)


def test_the_rougher_a_surface_the_more_it_returns_at_a_grazing_angle() -> None:
    returned = backscatter(np.full(20, 0.05), np.linspace(0, 1.5, 20))
    assert (np.diff(returned) > 0).all()
    assert returned.max() < 0.5
