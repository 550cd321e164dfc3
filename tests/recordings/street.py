"""A street of walls, kerbs and posts, and scans of it from known places, in the rain."""

import numpy as np
from numpy.typing import NDArray

from derain.files.extrinsics import motion_of_pose
from derain.scan import Scan

# Height of the sensor above the road, metres; noise of its ranges; and how far it sees.
HEIGHT, NOISE, REACH = 1.8, 0.02, 60.0


def motion(x: float = 0.0, y: float = 0.0, yaw: float = 0.0, pitch: float = 0.0) -> NDArray:
    """A rigid motion: ahead and to the left in metres, turns in degrees; (4, 4)."""
    return motion_of_pose(x, y, 0, 0, pitch, yaw)


def street(generator: np.random.Generator, points: int = 40_000) -> NDArray:
    """Points spread over the surfaces of a street along x, (N, 3), metres, world."""
    share = points // 10
    spread = generator.uniform(-1, 1, (points, 2))
    road = np.c_[80 * spread[: 5 * share, 0], 12 * spread[: 5 * share, 1], np.zeros(5 * share)]
    side = np.sign(generator.uniform(-1, 1, 3 * share))
    wall = spread[5 * share : 8 * share]
    # House after house, each set back by another metre or two: so there are walls across the road.
    x = 80 * wall[:, 0]
    walls = np.c_[x, side * (12 + x // 8 % 3), 3 + 3 * wall[:, 1]]
    place = generator.integers(-10, 10, 2 * share) * 8.0
    edge = spread[8 * share :]
    across = np.c_[place, 13 + edge[: 2 * share, 0], 3 + 3 * edge[: 2 * share, 1]]
    across[::2, 1] *= -1
    return np.concatenate([road, walls, across])


def scan_from(pose: NDArray, seed: int, drops: int = 500, world: NDArray | None = None) -> Scan:
    """What a sensor sees of the street: each scan meets it at other points, and other drops.

    Args:
        pose: Sensor to world, (4, 4).
        seed: Of this scan's points, noise and drops.
        drops: How many drops it meets.
        world: Another world than the street, (N, 3).
    """
    generator = np.random.default_rng(seed)
    seen = street(generator) if world is None else world
    back = np.linalg.inv(pose)
    seen = (seen - (0, 0, HEIGHT)) @ back[:3, :3].T + back[:3, 3]
    seen = seen[np.linalg.norm(seen, axis=1) < REACH]
    seen = seen + generator.normal(0, NOISE, seen.shape)
    rain = generator.uniform((-20, -10, -1), (20, 10, 4), (drops, 3))
    return Scan.of(np.concatenate([seen, rain]))
