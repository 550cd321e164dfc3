"""Directions of returns: which returns share a direction, and whether that is chance.

A sensor of two returns gives both the direction of their ray, to the last digits of the numbers.
Between these and the neighbouring rays nothing lies: where directions agree by chance, as those of
a rosette, of several sensors or of a shaken one do, there are about as many a little farther apart.
"""

import numpy as np

from derain.scan import Bools, Float32s, Floats, Ints

# Returns of one ray differ by at most this much in direction, degrees: by the rounding of
# coordinates to float32, or to millimetres. Of these the largest counts at which the returns of
# one ray stand out, which is where neighbouring rays are out of reach.
TOLERANCES = (0.05, 0.02, 0.01, 0.005, 0.002, 0.001)

# More returns in one direction are not of one ray: sensors distinguish up to three.
MOST_RETURNS = 3

# Directions agree by chance in the nearer half of a tolerance at most as often as in the farther.
# So many pairs, and so many times as many as in the farther half, are none: of 24 pairs 20 or more
# fall into the nearer half once in 1,000 scans.
FEWEST_PAIRS = 20
CLEARLY_MORE = 5

# Where slabs of inclination are laid end to end, each begins so many degrees behind the one before,
# which is longer than any of them.
SLAB_SPACING = 1000


def directions(xyz: Float32s) -> tuple[Floats, Floats]:
    """Azimuth and inclination of every point.

    Args:
        xyz: Finite coordinates, float32 (N, 3), metres in the sensor frame.

    Returns:
        Azimuth, counter-clockwise from x (forward) towards y (left), float64 (N,), degrees in
        [-180, 180]; and inclination above the horizon, float64 (N,), degrees in [-90, 90]. Zeros
        count as positive: straight behind is 180, and above and below the sensor, where every
        azimuth would do, it is 0.
    """
    # Adding 0 makes zeros positive: arctan2 distinguishes -0.0 from 0.0.
    x, y, z = np.ascontiguousarray(xyz.T, dtype=np.float64) + 0.0
    azimuth = np.degrees(np.arctan2(y, x))
    inclination = np.degrees(np.arctan2(z, np.sqrt(x * x + y * y)))
    return azimuth, inclination


def shared_direction_pairs(xyz: Float32s, evident: bool = True) -> Ints:
    """Pairs of points that lie in one direction from the sensor.

    Args:
        xyz: Finite and distinct positions other than the origin, float32 (M, 3), metres in the
            sensor frame.
        evident: True if pairs are none where so many could have come about by chance. Otherwise,
            such are those within the second smallest of TOLERANCES.

    Returns:
        int64 (P, 2), the lower number first; no point with as many as MOST_RETURNS others.
    """
    pairs, gap = _near_pairs(*directions(xyz), TOLERANCES[0])
    for tolerance in TOLERANCES:
        near = _uncrowded(pairs, gap <= tolerance, len(xyz))
        nearer_half = int((gap[near] <= tolerance / 2).sum())
        farther_half = int(near.sum()) - nearer_half
        if nearer_half >= max(FEWEST_PAIRS, CLEARLY_MORE * farther_half):
            return pairs[near]
    if evident:
        return pairs[:0]
    return pairs[_uncrowded(pairs, gap <= TOLERANCES[-2], len(xyz))]


def _near_pairs(azimuth: Floats, inclination: Floats, tolerance: float) -> tuple[Ints, Floats]:
    """Pairs of directions that differ by at most a tolerance, and by how much.

    Args:
        azimuth: float64 (M,), degrees in [-180, 180].
        inclination: float64 (M,), degrees in [-90, 90].
        tolerance: Degrees.

    Returns:
        int64 (P, 2), the lower number first, and degrees, float64 (P,). A direction that has more
        than MOST_RETURNS others about it has some of them only.
    """
    # Slabs are bands of inclination, each as high as two tolerances. A pair across a border of two
    # slabs lies in the middle of one of the other set, which is moved by half their height.
    found = [_pairs_in_slabs(azimuth, inclination, tolerance, shift) for shift in (0.0, 0.5)]
    pairs, gap = (np.concatenate(parts) for parts in zip(*found, strict=True))
    # Most pairs are found in both sets.
    _, first = np.unique(pairs[:, 0] * len(azimuth) + pairs[:, 1], return_index=True)
    return pairs[first], gap[first]


def _pairs_in_slabs(
    azimuth: Floats, inclination: Floats, tolerance: float, shift: float
) -> tuple[Ints, Floats]:
    """Those of the pairs of :func:`_near_pairs` that lie in one slab, each pair once.

    Args:
        azimuth: As there.
        inclination: As there.
        tolerance: As there.
        shift: How far the slabs are moved down, in heights of a slab.
    """
    height = 2 * tolerance
    slab = np.floor(inclination / height + shift)
    middle = (slab + 0.5 - shift) * height
    point, place = _laid_end_to_end(azimuth, slab, middle, tolerance)
    pairs, gaps = [], []
    # Along the places, what is near a direction is among the next few.
    for step in range(1, MOST_RETURNS + 1):
        one, other = point[:-step], point[step:]
        across = np.abs(inclination[one] - inclination[other])
        gap = np.maximum(place[step:] - place[:-step], across)
        near = np.flatnonzero((gap <= tolerance) & (one != other))
        pairs.append(np.sort(np.stack([one[near], other[near]], axis=1), axis=1))
        gaps.append(gap[near])
    return np.concatenate(pairs), np.concatenate(gaps)


def _laid_end_to_end(
    azimuth: Floats, slab: Floats, middle: Floats, tolerance: float
) -> tuple[Ints, Floats]:
    """Directions in the order of their places on one line, which holds slab after slab.

    Args:
        azimuth: float64 (M,), degrees in [-180, 180].
        slab: Number of the slab of each, float64 (M,).
        middle: Inclination of its middle, float64 (M,), degrees.
        tolerance: Degrees.

    Returns:
        Numbers of the directions, int64 (M + W,), and their places, ascending, float64 (M + W,), in
        degrees along the arc. W of them come twice, at both ends of their slab: those near the seam
        of the circle.
    """
    # The higher up, the shorter is the arc of a degree of azimuth.
    shortened = np.cos(np.radians(middle.clip(-90, 90)))
    along, circle = azimuth * shortened, 360 * shortened
    seam = np.flatnonzero(along + circle / 2 <= tolerance)
    point = np.concatenate([np.arange(len(azimuth)), seam])
    place = np.concatenate([along, along[seam] + circle[seam]]) + slab[point] * SLAB_SPACING
    order = np.argsort(place, kind="stable")
    return point[order], place[order]


def _uncrowded(pairs: Ints, near: Bools, points: int) -> Bools:
    """Those of the near pairs whose points are in fewer than MOST_RETURNS of them, bool (P,)."""
    crowded = np.bincount(pairs[near].ravel(), minlength=points) >= MOST_RETURNS
    return near & ~crowded[pairs].any(axis=1)
