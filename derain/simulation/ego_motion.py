"""Where a sensor that moves evenly is when it sends each beam of a scan."""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.sensor import Sensor


def moving_poses(
    sensor: Sensor, velocity: tuple[float, float], yaw_rate: float
) -> NDArray[np.float64]:
    """Poses of a sensor that begins its scan upright at the origin of a track, as it moves on.

    :meth:`derain.simulation.track.Track.cast` takes them, so that a scan is skewed by the motion
    as one that nobody has corrected: every point is where it was in the sensor's frame as its beam
    was sent.

    Args:
        sensor: The sensor; it moves at its mounting height.
        velocity: Ahead and to the left, as the sensor itself is turned at the time, m/s.
        yaw_rate: Degrees per second; positive turns left.

    Returns:
        Each takes points from the level frame of the sensor into the track's, float64 (N, 4, 4),
        metres, for the N rows of :meth:`Sensor.beams`.
    """
    sent, beam = np.unique(sensor.beam_times(), return_inverse=True)
    turned = np.radians(yaw_rate) * sent
    # On a circle one moves along the chord, towards half of the turn, by its length.
    chord = complex(*velocity) * sent * np.sinc(turned / 2 / np.pi) * np.exp(0.5j * turned)
    poses = np.tile(np.eye(4), (len(sent), 1, 1))
    poses[:, 0, 0] = poses[:, 1, 1] = np.cos(turned)
    poses[:, 1, 0], poses[:, 0, 1] = np.sin(turned), -np.sin(turned)
    poses[:, 0, 3], poses[:, 1, 3] = chord.real, chord.imag
    poses[:, 2, 3] = sensor.mounting_height
    return poses[beam]
