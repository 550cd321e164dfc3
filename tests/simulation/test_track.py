"""The ray-cast track against closed forms and a test of every ray with every triangle."""

from types import ModuleType

import numpy as np
import pytest

from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track, backscatter

SENSOR = Sensor(rows=16, columns=40)


@pytest.mark.parametrize("roughness", [0.0, 0.6])
def test_flat_ground_lies_where_its_angle_says_and_darkens_with_it(
    open3d: ModuleType, roughness: float
) -> None:
    plane = shapes.rectangle((-500, 500), (-500, 500), 0)
    track = Track.of([Surface(plane, TrackClass.ROAD, 0.3, roughness)])
    track.cast(Sensor(rows=4, columns=10))  # another sensor sees the same track
    clear = track.cast(SENSOR)
    sine = -SENSOR.beams()[:, 2]
    distance = SENSOR.mounting_height / np.where(sine > 0, sine, np.nan)
    hit = distance < SENSOR.maximum_range
    assert 0 < hit.sum() < len(hit)
    assert (clear.returned == hit).all()
    assert np.allclose(clear.range[hit], distance[hit], rtol=1e-4)
    returned = 0.3 * backscatter(sine[hit], np.full(hit.sum(), roughness))
    assert np.allclose(clear.reflectivity[hit], returned, rtol=1e-4)
    assert (clear.beam == np.arange(16 * 40)).all()
    assert (clear.label[hit] == TrackClass.ROAD).all()
    assert (clear.range[~hit] == SENSOR.maximum_range).all()


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


@pytest.mark.parametrize("roughness", [0.0, 0.1, 0.6, 1.0])
def test_light_comes_back_as_if_the_eye_were_where_the_light_is(roughness: float) -> None:
    angle, variance = np.radians(np.linspace(0, 89, 90)), roughness**2
    facing, grazing = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    expected = np.cos(angle) * (facing + grazing * np.sin(angle) * np.tan(angle))
    returned = backscatter(np.cos(angle), np.full(len(angle), roughness))
    np.testing.assert_allclose(returned, expected, rtol=1e-12)
    if not roughness:  # Lambert's to the bit
        assert np.array_equal(returned, np.cos(angle))
