"""Scans that break derainers; every method must return a finite, defined answer for them."""

from collections.abc import Iterator

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan


def scene(points: int = 3000, seed: int = 0) -> NDArray[np.float32]:
    """An ordinary small scene: a road, a wall, and drops in the air between.

    Args:
        points: Number of points.
        seed: Of the random generator.

    Returns:
        x, y, z in metres and intensity 0..255, float32 (points, 4).
    """
    generator = np.random.default_rng(seed)
    road, drops = points // 2, points // 10
    wall = points - road - drops
    x = np.concatenate(
        [
            generator.uniform(3, 60, road),
            generator.normal(40, 0.02, wall),
            generator.gamma(2, 4, drops),
        ]
    )
    y = generator.uniform(-15, 15, points)
    z = np.concatenate(
        [
            generator.normal(-1.8, 0.02, road),
            generator.uniform(-1.8, 6, wall),
            generator.uniform(-1.5, 4, drops),
        ]
    )
    intensity = np.concatenate(
        [
            generator.uniform(5, 60, road),
            generator.uniform(20, 200, wall),
            generator.uniform(0, 4, drops),
        ]
    )
    return np.stack([x, y, z, intensity], axis=1).astype(np.float32)


def hard_cases(largest: int = 20_000) -> Iterator[tuple[str, Scan]]:
    """Yields hard scans by name.

    Args:
        largest: Points of the largest scan.
    """
    ordinary = scene()
    yield "empty", Scan.of(ordinary[:0])
    yield "one point", Scan.of(ordinary[:1])
    yield "fewer points than neighbours", Scan.of(ordinary[:5])
    yield "all points identical", Scan.of(np.repeat(ordinary[:1], 500, axis=0))
    yield "40 % duplicates", Scan.of(np.concatenate([ordinary, ordinary[:2000]]))
    yield "NaN and infinite rows", Scan.of(_with_rows(ordinary, [np.nan, np.inf, -np.inf]))
    yield "points at the origin", Scan.of(_with_rows(ordinary, [0.0]))
    yield "sentinel cells", Scan.of(_with_rows(ordinary, [-1.0]))
    yield "nothing valid", Scan.of(np.full((100, 4), np.nan, np.float32))
    yield "range 1e-6 m", Scan.of(_scaled_to_range(ordinary, 1e-6))
    yield "range 1e4 m", Scan.of(_scaled_to_range(ordinary, 1e4))
    yield (
        "near and far together",
        Scan.of(
            np.concatenate([_scaled_to_range(ordinary, 1e-6), _scaled_to_range(ordinary, 1e4)])
        ),
    )
    yield "azimuth ±π", Scan.of(_behind(ordinary))
    yield "at the poles", Scan.of(ordinary * np.array([0, 0, 1, 1], np.float32))
    yield "a grid row without returns", Scan.of(_without_inclinations(ordinary, -3, -1))
    yield "many grid rows without returns", Scan.of(_without_inclinations(ordinary, -20, 3))
    yield "constant image", Scan.of(_sphere(range_=10, intensity=50))
    yield "on a line", Scan.of(ordinary * np.array([1, 0, 0, 1], np.float32))
    yield "intensity 0", Scan.of(ordinary * np.array([1, 1, 1, 0], np.float32))
    yield "intensity 65,535", Scan.of(_with_intensity(ordinary, 65_535))
    yield "no intensity", Scan(ordinary[:, :3].copy())
    yield "nothing but drops", Scan.of(ordinary[-300:])
    yield "no drops", Scan.of(ordinary[:-300])
    yield f"{largest:,} points", Scan.of(scene(largest))


def _with_rows(points: NDArray[np.float32], values: list[float]) -> NDArray[np.float32]:
    """Overwrites every tenth row with one of the values, in turn."""
    points = points.copy()
    rows = np.arange(0, len(points), 10)
    points[rows] = np.resize(np.array(values, np.float32), len(rows))[:, None]
    return points


def _scaled_to_range(points: NDArray[np.float32], reach: float) -> NDArray[np.float32]:
    points = points.copy()
    points[:, :3] *= reach / np.linalg.norm(points[:, :3], axis=1, keepdims=True)
    return points


def _behind(points: NDArray[np.float32]) -> NDArray[np.float32]:
    """Moves every point exactly behind the sensor, with y 0.0 or -0.0."""
    points = points * np.array([-1, 0, 1, 1], np.float32)
    points[::2, 1] = 0.0
    points[1::2, 1] = -0.0
    return points


def _without_inclinations(
    points: NDArray[np.float32], lowest: float, highest: float
) -> NDArray[np.float32]:
    """Removes the points between two inclinations, in degrees."""
    x, y, z = points[:, :3].T
    inclination = np.degrees(np.arctan2(z, np.hypot(x, y)))
    outside: NDArray[np.bool_] = (inclination < lowest) | (inclination > highest)
    return points[outside]


def _sphere(range_: float, intensity: float) -> NDArray[np.float32]:
    """Returns at one range and of one intensity, about one in each pixel of 64 × 256."""
    azimuth, inclination = np.meshgrid(
        np.radians(np.linspace(-180, 180, 256, endpoint=False)),
        np.radians(np.linspace(-25, 15, 64)),
    )
    x = np.cos(inclination) * np.cos(azimuth)
    y = np.cos(inclination) * np.sin(azimuth)
    points = range_ * np.stack([x, y, np.sin(inclination)], axis=-1).reshape(-1, 3)
    return np.column_stack([points, np.full(len(points), intensity)]).astype(np.float32)


def _with_intensity(points: NDArray[np.float32], intensity: float) -> NDArray[np.float32]:
    points = points.copy()
    points[:, 3] = intensity
    return points
