"""Confidence intervals of scores, by the bootstrap over scans."""

import numpy as np
from numpy.typing import NDArray

from derain.evaluation.counts import intersection_over_union

DRAWS = 2000
CONFIDENCE = 0.95

Interval = tuple[float, float]


def bootstrap(
    found: NDArray[np.int64], errors: NDArray[np.int64], generator: np.random.Generator
) -> tuple[list[Interval | None], list[Interval | None]]:
    """95 % intervals of every method's pooled IoU, and of what it is behind the best method's.

    Draws as many scans as there are, with replacement, ``DRAWS`` times.

    Every method is scored on the same draws: a hard scan lowers the IoU of all of them and hardly
    changes the difference between two. Consecutive scans of a sequence are alike, so that intervals
    over few sequences are too narrow. Draws without an IoU are left out.

    Args:
        found: Rain called rain, by method and scan, int64 (methods, scans).
        errors: False positives and false negatives together, of the same shape.
        generator: Draws the scans.

    Returns:
        The interval of each method's IoU, None where no draw has an IoU; and that of the best
        method's IoU minus each method's, on the same draws. Where the latter contains 0, these
        scans do not show which of the two is better. It is None where no draw has an IoU of both.

    Source: B. Efron, "Bootstrap Methods: Another Look at the Jackknife", Annals of Statistics,
        1979; percentile intervals.
    """
    scans = found.shape[1]
    # How often each scan is drawn.
    times = generator.multinomial(scans, np.full(scans, 1 / scans), DRAWS)
    iou = intersection_over_union(found @ times.T, errors @ times.T)
    pooled = intersection_over_union(found.sum(axis=1), errors.sum(axis=1))
    best = np.argmax(np.nan_to_num(pooled, nan=-1))
    return _intervals(iou), _intervals(iou[best] - iou)


def _intervals(draws: NDArray[np.float64]) -> list[Interval | None]:
    return [_interval(each[~np.isnan(each)]) for each in draws]


def _interval(draws: NDArray[np.float64]) -> Interval | None:
    if not len(draws):
        return None
    tail = 50 * (1 - CONFIDENCE)
    low, high = np.percentile(draws, [tail, 100 - tail]).tolist()
    return low, high
