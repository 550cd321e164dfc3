"""Back-projection from pixels to points: whose score a point is given that lost its pixel."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

# Pixels on each side of a point's own that a back-projection may choose from: a window of
# 5 × 5.
# Source: Milioto et al. 2019, RangeNet++; github.com/TiagoCortinhal/SalsaNext, salsanext.yml.
REACH = 2

# Steps (rows, columns) from a pixel to those of its window: to itself, then the nearest, then
# row-major. What is undecided otherwise goes to the earlier step.
_SPAN = range(-REACH, REACH + 1)
WINDOW_STEPS = sorted(
    ((row, column) for row in _SPAN for column in _SPAN),
    key=lambda step: (step[0] ** 2 + step[1] ** 2, step),
)

# The published vote: so many pixels vote, those farther off than the cutoff (weighted metres)
# abstain, and a difference in range weighs less the nearer the pixel is, by a Gaussian of so many
# pixels. Source: as above.
VOTERS = 5
CUTOFF = 1.0
SIGMA = 1.0
_BELL = np.exp(-(np.array(WINDOW_STEPS) ** 2).sum(axis=1) / (2 * SIGMA**2))
WEIGHTS = (1 - _BELL / _BELL.sum()).astype(np.float32)

# Points that vote at a time, which bounds the memory.
CHUNK = 50_000


@dataclass(frozen=True, eq=False)
class ProjectedPoints:
    """Points on a grid of H × W pixels, each of which shows its nearest.

    Attributes:
        pixel: Each point's own pixel, int64 (N,).
        range: Each point's range, float32 (N,), metres.
        nearest: The range that each pixel shows, float32 (H, W), metres; infinite where empty.
        wraps: True where the last column is the neighbour of the first.
    """

    pixel: NDArray[np.int64]
    range: NDArray[np.float32]
    nearest: NDArray[np.float32]
    wraps: bool


PixelsToPoints = Callable[[ProjectedPoints, NDArray[np.float32]], NDArray[np.float32]]


def copy(points: ProjectedPoints, score: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gives every point the score of its own pixel.

    Args:
        points: The points.
        score: One value per pixel, float32 (H · W,).

    Returns:
        One value per point, float32 (N,).
    """
    return score.take(points.pixel)


def nearest_range(points: ProjectedPoints, score: NDArray[np.float32]) -> NDArray[np.float32]:
    """Gives every point the score of the pixel around it that shows the range most like its own.

    A point that is shown has its own pixel's. What is hidden behind a drop follows the surface
    that the neighbouring pixels show, and not the drop. Of equally like pixels its own comes first,
    then the nearest, then the first in row-major order.

    Args:
        points: The points.
        score: One value per pixel, float32 (H · W,).

    Returns:
        One value per point, float32 (N,).
    """
    pixel = points.pixel.copy()
    hidden = np.flatnonzero(points.range > points.nearest.ravel().take(pixel))
    window = _Window(points)
    distance, at = points.range[hidden], window.position(pixel[hidden])
    best = at.copy()
    least = np.full(len(hidden), np.inf, np.float32)
    for step in window.steps:
        candidate = at + step
        difference = np.abs(window.nearest.take(candidate) - distance)
        # Only what is truly nearer, so that ties go to the earlier step.
        better = difference < least
        np.copyto(least, difference, where=better)
        np.copyto(best, candidate, where=better)
    pixel[hidden] = window.pixel.take(best)
    return score.take(pixel)


def vote(points: ProjectedPoints, score: NDArray[np.float32]) -> NDArray[np.float32]:
    """Lets the pixels around every point vote: the published k-NN search, mended for two classes.

    Of the window, the pixels most like the point in range vote rain if their score is above one
    half. The point's own pixel always votes, as if it showed the point. The published code leaves
    class 0 out of the count, takes the image's margin for returns of range 0 and does not close
    the circle; here both classes can win, and only pixels with a return vote. A tie is one half,
    which is not rain.

    Args:
        points: The points.
        score: One value per pixel, float32 (H · W,).

    Returns:
        Share of rain among the votes, float32 (N,): above one half where rain has the majority.

    Source: Milioto et al. 2019, RangeNet++, algorithm 1; github.com/TiagoCortinhal/SalsaNext,
        train/tasks/semantic/postproc/KNN.py.
    """
    window = _Window(points)
    rain = _padded(score.reshape(points.nearest.shape) > 0.5, points.wraps, False).ravel()
    result = np.empty(len(points.pixel), np.float32)
    for start in range(0, len(result), CHUNK):
        part = slice(start, start + CHUNK)
        candidates = window.position(points.pixel[part])[:, None] + window.steps
        difference = np.abs(window.nearest.take(candidates) - points.range[part, None])
        difference *= WEIGHTS
        difference[:, 0] = 0.0  # the first step leads to the point's own pixel
        voters = np.argsort(difference, axis=1, kind="stable")[:, :VOTERS]
        votes = np.take_along_axis(difference, voters, axis=1) <= CUTOFF
        says_rain = rain.take(np.take_along_axis(candidates, voters, axis=1))
        result[part] = (votes & says_rain).sum(axis=1) / votes.sum(axis=1)
    return result


# Every back-projection, by the name that the option `way_back` and a Spec have for it.
BACK_PROJECTIONS: Mapping[str, PixelsToPoints] = {
    "nearest range": nearest_range,
    "copy": copy,
    "vote": vote,
}


class _Window:
    """The pixels around each pixel, by flat position in an image padded on all sides.

    Attributes:
        nearest: Range that each position shows, float32, infinite where there is no return.
        pixel: Pixel at each position, int64.
        steps: Way to the positions of a window, in the order of ``WINDOW_STEPS``, int64 (25,).
    """

    def __init__(self, points: ProjectedPoints) -> None:
        height, self._width = points.nearest.shape
        number = np.arange(height * self._width).reshape(height, self._width)
        self.nearest = _padded(points.nearest, points.wraps, np.inf).ravel()
        self.pixel = _padded(number, points.wraps, -1).ravel()
        self._padded_width = self._width + 2 * REACH
        self.steps = np.array([row * self._padded_width + column for row, column in WINDOW_STEPS])

    def position(self, pixel: NDArray[np.int64]) -> NDArray[np.int64]:
        """Positions of pixels in the padded image, int64 (N,)."""
        row, column = np.divmod(pixel, self._width)
        position: NDArray[np.int64] = (row + REACH) * self._padded_width + column + REACH
        return position


def _padded(image: NDArray[Any], wraps: bool, value: float) -> NDArray[Any]:
    """The image with a margin: on a full circle of its other end, elsewhere of one value."""
    sides, ends = ((0, 0), (REACH, REACH)), ((REACH, REACH), (0, 0))
    wide = (
        np.pad(image, sides, mode="wrap") if wraps else np.pad(image, sides, constant_values=value)
    )
    padded: NDArray[Any] = np.pad(wide, ends, constant_values=value)
    return padded
