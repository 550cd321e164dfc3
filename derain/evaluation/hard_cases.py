"""Scans that break derainers; every method must return a finite, defined answer for them."""

from collections.abc import Iterator

import numpy as np

from derain.scan import Bools, Float32s, Scan


def scene(points: int = 3000, seed: int = 0) -> Float32s:
    """An ordinary small scene: a road, a wall, and drops in the air between.

    Args:
        points: Number of points.
        seed: Of the random generator.

    Returns:
        x, y, z in metres and intensity 0..255, float32 (points, 4).
    """
    generator = np.random.default_rng(seed)
    uniform, normal = generator.uniform, generator.normal
    road, drops = points // 2, points // 10
    wall = points - road - drops
    x = [uniform(3, 60, road), normal(40, 0.02, wall), generator.gamma(2, 4, drops)]
    y = uniform(-15, 15, points)
    z = [normal(-1.8, 0.02, road), uniform(-1.8, 6, wall), uniform(-1.5, 4, drops)]
    intensity = [uniform(5, 60, road), uniform(20, 200, wall), uniform(0, 4, drops)]
    columns = [np.concatenate(x), y, np.concatenate(z), np.concatenate(intensity)]
    return np.stack(columns, axis=1).astype(np.float32)


def hard_cases(largest: int = 20_000) -> Iterator[tuple[str, Scan]]:
    """Yields hard scans by name.

    Args:
        largest: Points of the largest scan.
    """
    ordinary = scene()
    near, far = _scaled_to_range(ordinary, 1e-6), _scaled_to_range(ordinary, 1e4)
    for name, points in {
        "empty": ordinary[:0],
        "one point": ordinary[:1],
        "fewer points than neighbours": ordinary[:5],
        "all points identical": np.repeat(ordinary[:1], 500, axis=0),
        "40 % duplicates": np.concatenate([ordinary, ordinary[:2000]]),
        "NaN and infinite rows": _with_rows(ordinary, [np.nan, np.inf, -np.inf]),
        "points at the origin": _with_rows(ordinary, [0.0]),
        "sentinel cells": _with_rows(ordinary, [-1.0]),
        "nothing valid": np.full((100, 4), np.nan, np.float32),
        "range 1e-6 m": near,
        "range 1e4 m": far,
        "near and far together": np.concatenate([near, far]),
        "azimuth ±π": _behind(ordinary),
        "at the poles": ordinary * np.array([0, 0, 1, 1], np.float32),
        "a grid row without returns": _without_inclinations(ordinary, -3, -1),
        "many grid rows without returns": _without_inclinations(ordinary, -20, 3),
        "constant image": _sphere(),
        "on a line": ordinary * np.array([1, 0, 0, 1], np.float32),
        "intensity 0": _with_intensity(ordinary, 0),
        "intensity 65,535": _with_intensity(ordinary, 65_535),
        "no intensity": ordinary[:, :3],
        "nothing but drops": ordinary[-300:],
        "no drops": ordinary[:-300],
        f"{largest:,} points": scene(largest),
    }.items():
        yield name, Scan.of(points)


def _with_rows(points: Float32s, values: list[float]) -> Float32s:
    """Overwrites every tenth row with one of the values, in turn."""
    points = points.copy()
    rows = np.arange(0, len(points), 10)
    points[rows] = np.resize(np.array(values, np.float32), len(rows))[:, None]
    return points


def _scaled_to_range(points: Float32s, reach: float) -> Float32s:
    points = points.copy()
    points[:, :3] *= reach / np.linalg.norm(points[:, :3], axis=1, keepdims=True)
    return points


def _behind(points: Float32s) -> Float32s:
    """Moves every point exactly behind the sensor, with y 0.0 or -0.0."""
    points = points * np.array([-1, 0, 1, 1], np.float32)
    points[::2, 1] = 0.0
    points[1::2, 1] = -0.0
    return points


def _without_inclinations(points: Float32s, lowest: float, highest: float) -> Float32s:
    """Removes the points between two inclinations, in degrees."""
    x, y, z = points[:, :3].T
    inclination = np.degrees(np.arctan2(z, np.hypot(x, y)))
    outside: Bools = (inclination < lowest) | (inclination > highest)
    return points[outside]


def _sphere() -> Float32s:
    """Returns at 10 m and of intensity 50, about one in each pixel of 64 × 256."""
    azimuth, inclination = np.meshgrid(
        np.radians(np.linspace(-180, 180, 256, endpoint=False)),
        np.radians(np.linspace(-25, 15, 64)),
    )
    x = np.cos(inclination) * np.cos(azimuth)
    y = np.cos(inclination) * np.sin(azimuth)
    points = 10 * np.stack([x, y, np.sin(inclination)], axis=-1).reshape(-1, 3)
    return np.column_stack([points, np.full(len(points), 50)]).astype(np.float32)


def _with_intensity(points: Float32s, intensity: float) -> Float32s:
    points = points.copy()
    points[:, 3] = intensity
    return points
