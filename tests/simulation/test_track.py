"""Shapes against school geometry; the ray-cast track against closed forms and all triangles."""

import numpy as np
import pytest

from derain.simulation import shapes
from derain.simulation.classes import TrackClass
from derain.simulation.objects import Surface
from derain.simulation.sensor import Sensor
from derain.simulation.shapes import Triangles
from derain.simulation.track import Track, backscatter


def area(triangles: Triangles) -> float:
    edges = triangles[:, 1:] - triangles[:, :1]
    return float(np.linalg.norm(np.cross(edges[:, 0], edges[:, 1]), axis=1).sum() / 2)


def test_boxes_and_cylinders_of_twelve_sides_have_the_areas_of_prisms() -> None:
    assert area(shapes.box(3, 2, 0.5, 2.0)) == pytest.approx(2 * (3 * 2 + 2 * 1.5 + 3 * 1.5))
    base = 12 / 2 * np.sin(2 * np.pi / 12) * 0.4**2
    side = 12 * 2 * np.sin(np.pi / 12) * 0.4 * 1.7
    assert area(shapes.cylinder(0.4, 0.3, 2.0)) == pytest.approx(2 * base + side)


def test_a_shape_spans_its_sizes_and_turns_x_towards_y() -> None:
    flat = shapes.rectangle((-1, 4), (2, 5), 0.5)
    assert area(flat) == pytest.approx(15)
    box = shapes.box(2, 0.1, 0, 1, at=(10, 3), heading=np.pi / 2)
    assert area(box) == pytest.approx(area(shapes.box(2, 0.1, 0, 1)))
    post = shapes.cylinder(0.5, 0, 1, at=(2, 3))
    profile = np.array([[0, 0], [4, 0], [4, 1], [0, 1]])
    lying = shapes.on_its_side(shapes.prism(profile, -0.5, 0.5))
    for shape, least, greatest in (
        (flat, [-1, 2, 0.5], [4, 5, 0.5]),
        (box, [9.95, 2, 0], [10.05, 4, 1]),
        (post, [1.5, 2.5, 0], [2.5, 3.5, 1]),
        (lying, [0, -0.5, 0], [4, 0.5, 1]),
        (shapes.placed(flat, 10, 0, np.pi / 2), [5, -1, 0.5], [8, 4, 0.5]),
        (shapes.raised(flat, 2), [-1, 2, 2.5], [4, 5, 2.5]),
    ):
        assert shape.min(axis=(0, 1)) == pytest.approx(least)
        assert shape.max(axis=(0, 1)) == pytest.approx(greatest)


def test_a_slope_lifts_by_a_share_of_the_distance() -> None:
    flat = shapes.rectangle((0, 100), (-10, 10), 0)
    lifted = shapes.sloped(flat, 0.04, -0.1)
    assert lifted[..., :2] == pytest.approx(flat[..., :2])
    assert lifted[..., 2] == pytest.approx(0.04 * flat[..., 0] - 0.1 * flat[..., 1])


def test_points_fill_an_ellipsoid_evenly() -> None:
    radii = (1.0, 2.0, 0.5)
    points = shapes.inside_ellipsoid(20_000, radii, np.random.default_rng(0)) / radii
    radius = np.linalg.norm(points, axis=1)
    assert radius.max() <= 1
    assert (radius < 0.5).mean() == pytest.approx(1 / 8, abs=0.01)
    assert np.abs(points.mean(axis=0)).max() < 0.02


def test_rods_run_between_their_ends_at_their_radius() -> None:
    starts, ends = np.random.default_rng(0).uniform(-3, 3, (2, 40, 3))
    ends[0] = starts[0] + (0, 0, 2)
    corners = shapes.rods(starts, ends, 0.1, sides=5).reshape(40, -1, 3)
    along = (ends - starts) / np.linalg.norm(ends - starts, axis=1, keepdims=True)
    offset = corners - starts[:, None]
    beside = offset - (offset * along[:, None]).sum(-1, keepdims=True) * along[:, None]
    assert np.linalg.norm(beside, axis=-1) == pytest.approx(0.1)
    reach = (offset * along[:, None]).sum(-1)
    assert reach.min(axis=1) == pytest.approx(0, abs=1e-9)
    assert reach.max(axis=1) == pytest.approx(np.linalg.norm(ends - starts, axis=1))


def test_sheets_have_the_area_of_their_outline_and_blades_half_of_length_by_width() -> None:
    x, z = np.linspace(0, 4, 6), np.linspace(0, 3, 9)
    assert area(shapes.sheet(shapes.upright_grid(x, z))) == pytest.approx(12)
    starts, ends = np.random.default_rng(0).uniform(-3, 3, (2, 40, 3))
    blades = shapes.blades(starts, ends, 0.02, np.random.default_rng(1))
    assert area(blades) == pytest.approx(0.01 * np.linalg.norm(ends - starts, axis=1).sum())


def test_what_is_clear_of_the_axis_is_farther_from_it_everywhere() -> None:
    triangles = np.random.default_rng(0).uniform(-3, 3, (50, 3, 3))
    share = np.linspace(0, 1, 2001)[:, None, None, None]
    edges = (1 - share) * triangles + share * np.roll(triangles, -1, axis=1)
    nearest = np.hypot(edges[..., 0], edges[..., 1]).min(axis=(0, 2))
    settled = np.abs(nearest - 0.5) > 2e-3
    clear = shapes.clear_of_axis(triangles, 0.5)
    # Only a triangle that the axis goes through is not clear of it though its edges are.
    first, second = triangles[..., :2], np.roll(triangles, -1, axis=1)[..., :2]
    turn = np.sign(first[..., 0] * second[..., 1] - first[..., 1] * second[..., 0])
    through = np.abs(turn.sum(axis=1)) == 3
    assert (clear == (nearest > 0.5) & ~through)[settled].all()
    overhead = np.array([[[2.0, 0, 1], [-2, 3, 1], [-2, -3, 1]]])
    assert not shapes.clear_of_axis(np.concatenate([overhead, overhead[:, ::-1]]), 0.5).any()
    assert shapes.clear_of_axis(shapes.placed(overhead, 5, 0), 2.9).all()


SENSOR = Sensor(rows=16, columns=40)


@pytest.mark.parametrize("roughness", [0.0, 0.6])
def test_flat_ground_lies_at_its_angle_and_darkens_with_it(open3d, roughness) -> None:
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


def test_casting_finds_the_nearest_of_all_triangles(open3d) -> None:
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
def test_light_comes_back_as_if_the_eye_were_where_the_light_is(roughness) -> None:
    angle, variance = np.radians(np.linspace(0, 89, 90)), roughness**2
    facing, grazing = 1 - 0.5 * variance / (variance + 0.33), 0.45 * variance / (variance + 0.09)
    expected = np.cos(angle) * (facing + grazing * np.sin(angle) * np.tan(angle))
    returned = backscatter(np.cos(angle), np.full(len(angle), roughness))
    np.testing.assert_allclose(returned, expected, rtol=1e-12)
    if not roughness:  # Lambert's to the bit
        assert np.array_equal(returned, np.cos(angle))
