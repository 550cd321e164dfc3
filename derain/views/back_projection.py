"""Back-projection from pixels to points: whose score a point is given that lost its pixel."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from derain.scan import Array, Bools, Float32s, Floats, Ints

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

# The published vote: this many pixels vote, those farther off than the cutoff (weighted metres)
# abstain, and a difference in range weighs less the nearer the pixel is, by a Gaussian of so many
# pixels. Source: as above.
VOTERS = 5
CUTOFF = 1.0
SIGMA = 1.0
_BELL = np.exp(-(np.array(WINDOW_STEPS) ** 2).sum(axis=1) / (2 * SIGMA**2))
WEIGHTS = (1 - _BELL / _BELL.sum()).astype(np.float32)

# A pixel that may vote: how much it differs in range, weighted, and its ballot, which is twice the
# number of the step that leads to it, and one more for rain. Taken as one integer, the more alike
# is less, and of equally like pixels the earlier step: the bits of differences, none of which is
# negative, ascend as the differences do.
VOTER = np.dtype([("ballot", "<i4"), ("difference", "<f4")])

# Points that look around at a time: what is computed on the way stays in the cache.
CHUNK = 2**13


@dataclass(frozen=True, eq=False)
class ProjectedPoints:
    """Points on a grid of H × W pixels, each of which shows its nearest.

    Attributes:
        pixel: Each point's own pixel, int64 (N,).
        range: Each point's range, float32 (N,), metres.
        nearest: The range that each pixel shows, float32 (H, W), metres; infinite where empty.
        wraps: True where the last column is the neighbour of the first.
    """

    pixel: Ints
    range: Float32s
    nearest: Float32s
    wraps: bool


def copy(points: ProjectedPoints, score: Float32s) -> Float32s:
    """Gives every point the score of its own pixel.

    Args:
        points: The points.
        score: One value per pixel, float32 (H · W,).

    Returns:
        One value per point, float32 (N,).
    """
    return score.take(points.pixel)


def nearest_range(points: ProjectedPoints, score: Float32s) -> Float32s:
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
    result = score.take(points.pixel)
    hidden = np.flatnonzero(points.range > points.nearest.take(points.pixel))
    window = _Window(points)
    for start in range(0, len(hidden), CHUNK):
        rows = hidden[start : start + CHUNK]
        result[rows] = score.take(window.closest_in_range(points.pixel[rows], points.range[rows]))
    return result


def vote(points: ProjectedPoints, score: Float32s) -> Float32s:
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
    rain = window.with_margin(score.reshape(points.nearest.shape) > 0.5, False)
    result = np.empty(len(points.pixel), np.float32)
    for start in range(0, len(result), CHUNK):
        part = slice(start, start + CHUNK)
        result[part] = window.share_of_votes(points.pixel[part], points.range[part], rain)
    return result


# Every back-projection, by the name that an option and a Spec have for it.
BACK_PROJECTIONS = {"nearest range": nearest_range, "copy": copy, "vote": vote}


class _Window:
    """The pixels around each pixel, in an image padded on all sides by the reach of a window."""

    def __init__(self, points: ProjectedPoints) -> None:
        self._width = points.nearest.shape[1]
        self._wraps = points.wraps
        padded_width = self._width + 2 * REACH
        # Where they lead from the upper left corner of a window, in the flat padded image.
        self._steps = [
            (row + REACH) * padded_width + column + REACH for row, column in WINDOW_STEPS
        ]
        self._nearest = self.with_margin(points.nearest, np.inf)

    def with_margin(self, image: Array, value: float) -> Array:
        """An image (H, W), padded and flat.

        On a full circle its sides continue at the other end; all else of the margin has one value.
        """
        above_and_below, aside = ((REACH, REACH), (0, 0)), ((0, 0), (REACH, REACH))
        tall = np.pad(image, above_and_below, constant_values=value)
        if self._wraps:
            return np.pad(tall, aside, mode="wrap").ravel()
        return np.pad(tall, aside, constant_values=value).ravel()

    def closest_in_range(self, pixel: Ints, distance: Float32s) -> Ints:
        """The pixel around each pixel that shows the range most like a point's, int64 (N,)."""
        best = np.zeros(len(pixel), np.uint8)
        least = np.full(len(pixel), np.inf, np.float32)
        for number, difference in enumerate(self._differences(pixel, distance)):
            # Only what is truly nearer, so that ties go to the earlier step. The last step that was
            # nearer has the highest number: to take the maximum is faster than to write by a mask.
            np.maximum(best, (difference < least) * np.uint8(number), out=best)
            np.minimum(least, difference, out=least)
        down, right = np.array(WINDOW_STEPS).T
        row = pixel // self._width
        column = pixel - row * self._width + right.take(best)
        if self._wraps:
            column %= self._width
        return np.asarray((row + down.take(best)) * self._width + column)

    def share_of_votes(self, pixel: Ints, distance: Float32s, rain: Bools) -> Floats:
        """Share of rain among the votes of the pixels around each pixel, float64 (N,)."""
        corner = self._corner(pixel)
        voters = np.empty((len(pixel), len(WINDOW_STEPS)), VOTER)
        for number, difference in enumerate(self._differences(pixel, distance)):
            # The first step leads to the point's own pixel, which votes as if it showed the point.
            voters["difference"][:, number] = difference * WEIGHTS[number] if number else 0
            voters["ballot"][:, number] = 2 * number + rain[self._steps[number] :].take(corner)
        chosen = np.partition(voters.view("<i8"), VOTERS - 1, axis=1)[:, :VOTERS]
        # Voter by voter, which is several times faster than along the short axis.
        chosen = np.ascontiguousarray(chosen.T).view(VOTER)
        votes = chosen["difference"] <= CUTOFF
        for_rain = chosen["ballot"] % 2 == 1
        return np.asarray((votes & for_rain).sum(axis=0) / votes.sum(axis=0))

    def _differences(self, pixel: Ints, distance: Float32s) -> Iterator[Float32s]:
        """Differences in range between the pixels around each pixel and a point, step by step."""
        corner = self._corner(pixel)
        for step in self._steps:
            yield np.abs(self._nearest[step:].take(corner) - distance)

    def _corner(self, pixel: Ints) -> Ints:
        """Start of the window around each pixel in the padded image, int64 (N,)."""
        return np.asarray(pixel + pixel // self._width * (2 * REACH))
