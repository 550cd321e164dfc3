"""The scan pattern of a sensor, from its returns: field of view, beams, and angular steps."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from derain.scan import Floats, Ints, Scan
from derain.views.directions import directions
from derain.views.spherical_grid import ALL_AROUND, FULL_CIRCLE, Extent

# A degree belongs to the field of view, and a cluster to the beams, if it holds at least this
# share of what the degree or cluster of a typical return holds. The rest are outliers.
SPARSE = 0.01

# A sensor that leaves at least this much of the circle without returns looks only one way, degrees.
REAL_GAP = 30.0

# Returns nearer to each other than this are of one beam or one shot, degrees: no sensor is finer.
FINEST_STEP = 0.01

# The step if there are too few returns to measure it, degrees; usual for spinning sensors.
USUAL_STEP = 0.2

# Clusters of inclination are beams if they take up at most this share of the field of view (beams
# fixed in the sensor take up a millionth, those that motion or an offset blurs a tenth or more), if
# a typical one has this many returns, and if they leave few returns out.
COVERAGE = 0.01
RETURNS = 10
IN_CLUSTERS = 0.99

# Rows of an organised scan are beams if this share of the returns is nearest to its own row.
IN_OWN_ROW = 0.9


@dataclass(frozen=True, eq=False)
class ReturnAngles:
    """Directions of the returns of one scan.

    Attributes:
        azimuth: Of each valid point, float64 (N,), degrees in [-180, 180].
        inclination: Of each valid point, float64 (N,), degrees in [-90, 90].
        row: Its row in an organised scan, int64 (N,); None in any other scan.
    """

    azimuth: Floats
    inclination: Floats
    row: Ints | None

    @classmethod
    def of(cls, scan: Scan) -> "ReturnAngles":
        """The angles of a scan's valid points."""
        valid = np.flatnonzero(scan.valid)
        azimuth, inclination = directions(scan.xyz.take(valid, axis=0))
        return cls(azimuth, inclination, valid // scan.shape[1] if scan.shape else None)


def azimuth_extent(azimuth: Floats) -> Extent:
    """Right and left end of what the sensor sees, degrees.

    Args:
        azimuth: Azimuths of returns, float64 (N,), N > 0, degrees in [-180, 180].

    Returns:
        The ends, the left one beyond 180 where the sensor looks backward; all around unless a real
        gap is left.
    """
    seen = _well_seen((azimuth + 180).astype(np.int64) % 360)
    gaps = np.diff(seen, append=seen[0] + 360)
    widest = int(gaps.argmax())
    if gaps[widest] - 1 < REAL_GAP:
        return ALL_AROUND
    right = float(seen[(widest + 1) % len(seen)]) - 180
    from_right = (azimuth - right) % FULL_CIRCLE
    inside = from_right[from_right <= FULL_CIRCLE - gaps[widest] + 1]
    return right + float(inside.min()), right + float(inside.max())


def inclination_extent(inclination: Floats) -> Extent:
    """Lower and upper end of what the sensor sees, outliers left out, degrees.

    Args:
        inclination: Inclinations of returns, float64 (N,), N > 0, degrees in [-90, 90].
    """
    degree = np.floor(inclination).astype(np.int64)
    seen = _well_seen(degree + 90) - 90
    inside = inclination[(degree >= seen[0]) & (degree <= seen[-1])]
    return float(inside.min()), float(inside.max())


def find_beams(scans: Sequence[ReturnAngles]) -> Floats:
    """Inclinations of the sensor's beams, if they can be found.

    Args:
        scans: Angles of the returns of one or more scans of one sensor.

    Returns:
        Inclinations from top to bottom, float64 (beams,), degrees; none where the returns of
        different beams mingle.
    """
    inclination = np.concatenate([scan.inclination for scan in scans])
    rows = [scan.row for scan in scans if scan.row is not None]
    beams = np.zeros(0)
    if len(rows) == len(scans):
        beams = _beams_of_rows(inclination, np.concatenate(rows))
    return (beams if beams.size else _beams_of_clusters(np.sort(inclination)))[::-1]


def azimuth_step(scans: Sequence[ReturnAngles], borders: Sequence[float]) -> float:
    """Azimuth from a return to the next of the same beam, degrees.

    Args:
        scans: Angles of the returns of one or more scans of one sensor.
        borders: Inclinations between which the returns are of one beam, ascending, degrees.
    """
    slabs = [np.searchsorted(borders, scan.inclination) for scan in scans]
    return _median_gap([scan.azimuth for scan in scans], slabs)


def inclination_step(scans: Sequence[ReturnAngles], azimuth_step: float) -> float:
    """Inclination from a return to the next of the same shot, degrees.

    Args:
        scans: Angles of the returns of one or more scans of one sensor.
        azimuth_step: Azimuth from one shot to the next, degrees.
    """
    # A little less than a step, or else evenly spaced shots could come to lie two in one slab.
    width = 0.95 * azimuth_step
    slabs = [np.floor(scan.azimuth / width).astype(np.int64) for scan in scans]
    return _median_gap([scan.inclination for scan in scans], slabs)


def _median_gap(angles: Sequence[Floats], slabs: Sequence[Ints]) -> float:
    """Median gap between the angles that lie in one slab, of angles and slab numbers by scan."""
    # Slabs are laid end to end, farther apart than any two angles.
    of_scans = zip(angles, slabs, strict=True)
    lines = [np.sort(slab * (2 * FULL_CIRCLE) + angle) for angle, slab in of_scans]
    gaps = np.concatenate([np.diff(line) for line in lines])
    gaps = gaps[(gaps > FINEST_STEP) & (gaps < FULL_CIRCLE)]
    return float(np.median(gaps)) if len(gaps) else USUAL_STEP


def _beams_of_rows(inclination: Floats, row: Ints) -> Floats:
    """Beams of an organised scan, a row each: ascending, float64 (beams,), degrees, or none."""
    by_row = np.lexsort((inclination, row))
    rows, starts, counts = np.unique(row[by_row], return_index=True, return_counts=True)
    medians = inclination[by_row][starts + counts // 2]
    ascending = np.argsort(medians)
    beams = medians[ascending]
    nearest = rows[ascending][np.searchsorted((beams[1:] + beams[:-1]) / 2, inclination)]
    separate = len(beams) > 1 and np.mean(nearest == row) >= IN_OWN_ROW
    return beams if separate else np.zeros(0)


def _beams_of_clusters(ascending: Floats) -> Floats:
    """Beams whose returns share one inclination: ascending, float64 (beams,), degrees, or none."""
    starts = np.flatnonzero(np.diff(ascending, prepend=-np.inf) > FINEST_STEP)
    ends = np.append(starts[1:], len(ascending))
    sizes = ends - starts
    typical = _typical(sizes)
    is_beam = sizes >= SPARSE * typical
    widths = (ascending[ends - 1] - ascending[starts])[is_beam]
    separate = (
        len(widths) > 1
        and typical >= RETURNS
        and sizes[is_beam].sum() >= IN_CLUSTERS * len(ascending)
        and widths.sum() <= COVERAGE * (ascending[-1] - ascending[0])
    )
    return ascending[(starts + ends) // 2][is_beam] if separate else np.zeros(0)


def _well_seen(degree: Ints) -> Ints:
    """Whole degrees that hold more than outliers, ascending."""
    counts = np.bincount(degree)
    return np.flatnonzero(counts >= max(1.0, SPARSE * _typical(counts)))


def _typical(sizes: Ints) -> float:
    """Size of the group that a typical member belongs to: groups weigh as much as they hold."""
    ascending = np.sort(sizes)
    held = np.cumsum(ascending)
    return float(ascending[np.searchsorted(held, held[-1] / 2)])
