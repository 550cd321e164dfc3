"""Bands of range, their names, and the band of each point."""

from collections.abc import Sequence
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

# Where the bands start, metres; the last band is open.
RANGE_EDGES = (0, 10, 20, 40, 80)


def band_names() -> list[str]:
    """Names of the bands of ``RANGE_EDGES``, such as ``0-10 m`` and, for the last, ``80+ m``."""
    names = [f"{start}-{end} m" for start, end in pairwise(RANGE_EDGES)]
    return [*names, f"{RANGE_EDGES[-1]}+ m"]


def band_of(range: NDArray[np.floating], edges: Sequence[float] = RANGE_EDGES) -> NDArray[np.int64]:
    """Number of each point's band, int64 (N,).

    Args:
        range: Distance from the sensor, metres, (N,). Values that are not finite belong to the
            last band.
        edges: Where the bands start, metres, rising from 0.
    """
    finite_or_far = np.where(np.isfinite(range), range, np.inf)
    return np.searchsorted(edges[1:], finite_or_far, side="right").astype(np.int64)
