"""Augmentations that imitate users' changes to scans: thin, shake, double, move, cut, scale, tilt.

A network that has met all of these in its training does not depend on any.
"""

from collections.abc import Callable
from dataclasses import replace

import numpy as np

from derain.scan import Bools, Float32s, Floats, Scan
from derain.simulation.drawing import log_uniform
from derain.views.spherical_grid import FULL_CIRCLE

# How many of the changes are made to a scan, and how often each number of them.
CHANGES = (1, 2)
HOW_OFTEN = (2 / 3, 1 / 3)

# Spans that sizes are drawn from, in the logarithm where they span decades. All are modelling
# choices: from the precision of a good sensor to what makes a scan useless.
SHARE_KEPT = (0.15, 1.0)
SPREAD_ACROSS = (0.004, 0.06)  # metres
SPREAD_ALONG = (0.005, 0.05)  # metres
APART = (1e-6, 0.03)  # metres along the ray between a point and its copy
ASIDE = (1e-6, 0.003)  # metres across it, ...
ALSO_ASIDE = 0.3  # ... in this share of the scans
OFFSETS = (3.5, 1.5, 1.5)  # metres along x, y and z, either way
SECTOR = (60.0, 200.0)  # degrees
SCALE = (0.3, 3.3)
TILT = 20.0  # degrees, either way

# A scan is not cut or thinned to fewer points.
FEWEST_POINTS = 500

# Of what is divided by: right above the sensor no direction is aside.
LEAST = 1e-12


def changed_as_by_users(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan after one or two of the changes.

    Args:
        scan: The scan, of valid points.
        generator: Draws which, and by how much.
    """
    names = generator.choice(
        list(ALL_CHANGES), generator.choice(CHANGES, p=HOW_OFTEN), replace=False
    )
    for name in names:
        scan = ALL_CHANGES[name](scan, generator)
    return scan


def thinned(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan with points missing at random."""
    return _of_enough(scan, generator.random(len(scan)) < log_uniform(SHARE_KEPT, generator))


def shaken_across(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan with noise across the rays."""
    return replace(scan, xyz=across(scan.xyz, log_uniform(SPREAD_ACROSS, generator), generator))


def shaken_along(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan with noise of its ranges."""
    spread = log_uniform(SPREAD_ALONG, generator)
    return replace(scan, xyz=along(scan.xyz, generator.normal(0, spread, len(scan))))


def doubled(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan with half of its points, or all, written twice, hardly apart."""
    twice = np.flatnonzero(generator.random(len(scan)) < generator.choice([0.5, 1.0]))
    apart = generator.normal(0, log_uniform(APART, generator), len(twice))
    copies = along(scan.xyz[twice], apart)
    if generator.random() < ALSO_ASIDE:
        copies = across(copies, log_uniform(ASIDE, generator), generator)
    both = scan.take(np.concatenate([np.arange(len(scan)), twice]))
    return replace(both, xyz=np.concatenate([scan.xyz, copies]))


def moved(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan in the frame of something else than the sensor, such as the vehicle."""
    offset = generator.uniform(-1, 1, 3) * OFFSETS
    return replace(scan, xyz=(scan.xyz + offset).astype(np.float32))


def cut(scan: Scan, generator: np.random.Generator) -> Scan:
    """A sector of a scan around one of its points."""
    return _of_enough(scan, in_sector(scan, generator.uniform(*SECTOR), generator))


def scaled(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan in another unit than metres."""
    return replace(scan, xyz=scan.xyz * np.float32(log_uniform(SCALE, generator)))


def tilted(scan: Scan, generator: np.random.Generator) -> Scan:
    """A scan of a sensor that leans to the side, or forward."""
    angle = np.radians(generator.uniform(-TILT, TILT))
    cosine, sine = np.cos(angle), np.sin(angle)
    sideways = np.array([[1, 0, 0], [0, cosine, sine], [0, -sine, cosine]])
    forward = np.array([[cosine, 0, sine], [0, 1, 0], [-sine, 0, cosine]])
    turn = sideways if generator.random() < 0.5 else forward
    return replace(scan, xyz=(scan.xyz @ turn).astype(np.float32))


ALL_CHANGES: dict[str, Callable[[Scan, np.random.Generator], Scan]] = {
    change.__name__: change
    for change in (thinned, shaken_across, shaken_along, doubled, moved, cut, scaled, tilted)
}


def along(xyz: Float32s, metres: Floats) -> Float32s:
    """Points moved along their rays, away from the sensor, float32 (N, 3).

    Args:
        xyz: Positions in the sensor's frame, none at the origin, float32 (N, 3), metres.
        metres: Distances, float64 (N,).
    """
    return (xyz + _rays(xyz) * metres[:, None]).astype(np.float32)


def across(xyz: Float32s, spread: float, generator: np.random.Generator) -> Float32s:
    """Points moved aside and up, across their rays, at random, float32 (N, 3).

    Args:
        xyz: Positions in the sensor's frame, none at the origin, float32 (N, 3), metres.
        spread: Standard deviation either way, metres.
        generator: Draws how far.
    """
    rays = _rays(xyz)
    aside = np.cross([0, 0, 1], rays)
    aside /= np.maximum(np.linalg.norm(aside, axis=1, keepdims=True), LEAST)
    aside_by, up_by = generator.normal(0, spread, (2, len(xyz), 1))
    return (xyz + aside * aside_by + np.cross(rays, aside) * up_by).astype(np.float32)


def in_sector(scan: Scan, width: float, generator: np.random.Generator) -> Bools:
    """True for points in a sector around one of the valid points; at least one must be valid.

    Args:
        scan: The scan.
        width: Of the sector, degrees.
        generator: Draws the point.

    Returns:
        bool (N,).
    """
    azimuth = np.degrees(np.arctan2(scan.xyz[:, 1], scan.xyz[:, 0]))
    off = azimuth - azimuth[generator.choice(np.flatnonzero(scan.valid))]
    off = (off + FULL_CIRCLE / 2) % FULL_CIRCLE - FULL_CIRCLE / 2
    return np.abs(off) <= width / 2


def _rays(xyz: Float32s) -> Floats:
    """Unit vectors from the sensor, float64 (N, 3)."""
    wide = xyz.astype(np.float64)
    rays: Floats = wide / np.linalg.norm(wide, axis=1, keepdims=True)
    return rays


def _of_enough(scan: Scan, kept: Bools) -> Scan:
    """The kept points of a scan; all of it where those are too few."""
    return scan.take(kept) if kept.sum() >= FEWEST_POINTS else scan
