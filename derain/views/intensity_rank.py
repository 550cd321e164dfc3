"""Ranks of intensities within their scan, which do not depend on the unit of intensity."""

import numpy as np

from derain.scan import Float32s, Ints, Scan

# Steps in which intensities are ranked.
INTENSITY_RANKS = 32


def intensity_rank(scan: Scan) -> Ints:
    """Ranks of the points of a scan by their intensity.

    Every intensity that occurs counts by the root of how often it does: where most of the points
    share one, such as 0, the others still differ.

    Args:
        scan: The scan.

    Returns:
        From 0, the darkest, to INTENSITY_RANKS - 1, int64 (N,); all 0 where intensity was not
        measured.
    """
    intensity = scan.measured_intensity
    if intensity is None:
        return np.zeros(len(scan), np.int64)
    levels, points = np.unique(intensity[scan.valid], return_counts=True)
    darker = np.append(0, np.cumsum(np.sqrt(points)))  # than each level, and than none
    steps = np.arange(1, INTENSITY_RANKS) / INTENSITY_RANKS * darker[-1]
    first_level = np.searchsorted(darker[:-1], steps)
    edges = np.append(levels, np.float32(np.inf))[first_level]
    return edges_reached(intensity, edges)


def edges_reached(values: Float32s, edges: Float32s) -> Ints:
    """Number of edges that are no greater than each value.

    Args:
        values: float32 (N,).
        edges: A few, which are faster to compare one by one than to search, float32 (E,).

    Returns:
        int64 (N,); 0 where a value is NaN.
    """
    reached = np.zeros(len(values), np.uint8)
    for edge in edges:
        reached += values >= edge
    return reached.astype(np.int64)
