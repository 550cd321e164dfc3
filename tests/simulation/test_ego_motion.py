"""Poses of a sensor that moves while it takes a scan."""

import numpy as np
import pytest

from derain.simulation.classes import TrackClass
from derain.simulation.ego_motion import moving_poses
from derain.simulation.objects import Surface
from derain.simulation.sensor import Sensor
from derain.simulation.track import Track

SENSOR = Sensor(azimuth=(-180, 180), rows=2, columns=200, mounting_height=1.5)
TIMES = SENSOR.beam_times()


def test_a_sensor_that_stands_is_at_the_origin_all_the_time() -> None:
    standing = np.eye(4)
    standing[2, 3] = 1.5
    assert (moving_poses(SENSOR, (0, 0), 0) == standing).all()


def test_it_moves_along_a_line_where_it_does_not_turn() -> None:
    poses = moving_poses(SENSOR, (15.0, -2.0), 0)
    assert np.allclose(poses[:, :3, 3], TIMES[:, None] * (15, -2, 0) + (0, 0, 1.5))
    assert np.allclose(poses[:, :3, :3], np.eye(3))


def test_it_moves_on_a_circle_where_it_turns() -> None:
    poses = moving_poses(SENSOR, (10.0, 0.0), 180.0)
    radius = 10 / np.pi
    centre = np.array([0, radius])
    assert np.allclose(np.linalg.norm(poses[:, :2, 3] - centre, axis=1), radius)
    # It looks along the circle, by its turn away from where it began.
    assert np.allclose(poses[:, :2, 0], np.stack([np.cos(np.pi * TIMES), np.sin(np.pi * TIMES)], 1))
    assert np.allclose(((poses[:, :2, 3] - centre) * poses[:, :2, 0]).sum(axis=1), 0)


@pytest.mark.usefixtures("open3d")
def test_a_wall_ahead_comes_nearer_beam_by_beam() -> None:
    corners = np.array([[20.0, y, z] for y, z in ((-500, -500), (500, -500), (0, 900))])
    wall = Track.of([Surface(corners[None], TrackClass.BACKGROUND, 0.5)])
    seen = wall.cast(SENSOR, moving_poses(SENSOR, (30.0, 0.0), 0))
    ahead = SENSOR.beams()[:, 0] > 0.5
    expected = (20 - 30 * TIMES[ahead]) / SENSOR.beams()[ahead, 0]
    assert np.allclose(seen.range[ahead], expected, rtol=1e-5)
