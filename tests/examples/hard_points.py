"""Scans on which a program that reads models differs from derain, if it does anything otherwise."""

from pathlib import Path

import numpy as np

from derain.evaluation.hard_cases import scene
from derain.scan import Float32s

# 3D-OutDet, as an early derain exported it.
KEPT = Path(__file__).parents[1] / "export" / "kept" / "outdet.onnx"


def hard_points() -> Float32s:
    """A scene with ties, several rows at a position, and rows of every kind that is invalid.

    Returns:
        x, y, z in metres and intensity 0..255, float32 (N, 4), in no order.
    """
    nan, infinite = np.nan, np.inf
    generator = np.random.default_rng(3)
    # Of a lattice every point has many neighbours that are equally far.
    steps = np.stack(np.meshgrid(*[np.arange(5.0)] * 3), axis=-1)
    lattice = steps.reshape(-1, 3) + np.array([3, -2, -1])
    lattice = np.column_stack([lattice, generator.uniform(0, 255, len(lattice))])
    again = lattice[generator.choice(len(lattice), 60)] + [0, 0, 0, 1]
    zeros = [[0.0, 4, 1, 9], [-0.0, 4, 1, 10], [6, -0.0, 0.0, 11], [6, 0.0, -0.0, 12]]
    behind = [[-7, 0.0, 1, 3], [-7, -0.0, 1.5, 3], [0, 0, 3, 3], [-0.0, 0, -3, 3]]
    invalid = [
        [nan, 1, 1, 5],
        [1, infinite, 1, 5],
        [1, 1, -infinite, 5],
        [1, 1, 2e6, 5],
        [0, 0, 0, 5],
        [-0.0, 0, 0, 0],
        [-1, -1, -1, -1],
        [9, 1, 1, nan],
        [9, 2, 1, 2e7],
    ]
    no_returns = [[3.0, 0, 0.5, 0]] * 60
    parts = (scene(250), lattice, again, zeros, behind, no_returns, [[-1, -1, -1, 5]], invalid)
    points = np.concatenate([np.asarray(part, np.float32) for part in parts])
    return generator.permutation(points)


def hard_scans() -> dict[str, Float32s]:
    """Scans by what is hard about them."""
    hard = hard_points()
    one_intensity, unknown = hard.copy(), hard.copy()
    one_intensity[np.isfinite(hard[:, 3]) & (hard[:, 3] >= 0), 3] = 7
    one_intensity = one_intensity[one_intensity[:, 3] == 7]
    unknown[:, 3] = np.nan
    twice = np.concatenate([scene(250), scene(250)])
    rays = twice[250:, :3] / np.linalg.norm(twice[250:, :3], axis=1, keepdims=True)
    twice[250:, :3] += 0.004 * rays
    return {
        "ties, copies, invalid rows": hard,
        "written twice": np.random.default_rng(4).permutation(twice).astype(np.float32),
        "one intensity": one_intensity,
        "no intensity": unknown,
        "fewer points than neighbours": np.float32([[5, 1, 0, 3], [5, 2, 0, 4], [5, 2, 0, 5]]),
        "one point": np.float32([[5, 1, 0, 3]]),
        "nothing valid": np.full((20, 4), np.nan, np.float32),
        "empty": np.zeros((0, 4), np.float32),
    }


SCANS = hard_scans()
