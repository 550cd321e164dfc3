"""The range view: a scan as the image that the sensor saw."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import Entry
from derain.scan import Array, Bools, Float32s, Ints, Scan
from derain.views.back_projection import BACK_PROJECTIONS, ProjectedPoints
from derain.views.candidates import Candidates
from derain.views.channels import Channels, FillValues, channel_image
from derain.views.spherical_grid import Extent, SphericalGrid, grid_at
from derain.views.view import IGNORED, VIEWS, BackProjection, View, ViewedScan

# What a pixel shows. Taken as one integer, what is nearer is less, and of equally near points the
# lower row: the bits of ranges, none of which is negative, ascend as the ranges do.
SHOWN_POINT = np.dtype([("row", "<i4"), ("range", "<f4")])
NOTHING_SHOWN = np.array((-1, np.inf), SHOWN_POINT).view("<i8")[()]


@dataclass(frozen=True, eq=False)
class RangeImage(ViewedScan):
    """One scan as a network on images sees it.

    Attributes:
        image: The view's channels, each in its own unit, float32 (C, H, W); 0 where nothing
            returned.
        valid: True where something returned, bool (H, W).
        pixel: Pixel of each row of the scan, int64 (N,); -1 for invalid rows and for points
            outside the grid.
        winner: Row of the scan that each pixel shows, int64 (H · W,); -1 where nothing returned.
        nearest: Range that each pixel shows, float32 (H, W), metres; infinite where nothing
            returned.
        range: Range of each row of the scan, float32 (N,), metres.
        wraps: True where the last column is the neighbour of the first.
        back_projection_name: Name of the back-projection, by which points that are not shown get a
            score.
        candidate: Rows of the scan that may be rain, bool (N,); None where all may be.
    """

    image: Float32s
    valid: Bools
    pixel: Ints
    winner: Ints
    nearest: Float32s
    range: Float32s
    wraps: bool
    back_projection_name: str
    candidate: Bools | None = None

    @property
    def size(self) -> int:
        """H · W, the number of pixels that the network scores."""
        return self.valid.size

    @property
    def judged(self) -> Bools:
        """True for rows of the scan that lie on the grid, bool (N,)."""
        return self.pixel >= 0

    @property
    def hidden(self) -> Bools:
        """True for points on the grid whose pixel shows a nearer return, bool (N,)."""
        return self.judged & (self.range > self.nearest.ravel()[self.pixel])

    def inputs(self) -> dict[str, Array]:
        """The network's inputs, a batch of one: image (1, C, H, W) and valid (1, 1, H, W)."""
        return {"image": self.image[None], "valid": self.valid[None, None]}

    def target(self, rain: Bools) -> Ints:
        """Training target of each pixel.

        Args:
            rain: Truth for every row of the scan, bool (N,).

        Returns:
            1 for rain, 0 for everything else, ``IGNORED`` where nothing returned that may be rain,
            int64 (H · W,).
        """
        result = np.full(self.size, IGNORED)
        asked = np.flatnonzero(self._shows_candidate())
        result[asked] = rain[self.winner[asked]]
        return result

    def back_projection(self) -> BackProjection:
        """Back-projection of pixel scores to points, by ``back_projection_name``.

        Rows off the grid, and rows that are no candidates, have 0; a pixel that shows what is no
        candidate counts as scored 0, for any score of the network.
        """
        if self.candidate is None:
            rows, asked = np.flatnonzero(self.judged), None
        else:
            rows, asked = np.flatnonzero(self.judged & self.candidate), self._shows_candidate()
        points = ProjectedPoints(self.pixel[rows], self.range[rows], self.nearest, self.wraps)
        return partial(_to_rows, self.back_projection_name, points, rows, len(self.pixel), asked)

    @staticmethod
    def pack(seen: Sequence["RangeImage"]) -> dict[str, Array]:
        """Inputs of several scans on one grid as one batch."""
        return {
            "image": np.stack([one.image for one in seen]),
            "valid": np.stack([one.valid[None] for one in seen]),
        }

    def _shows_candidate(self) -> Bools:
        """True for pixels that show what may be rain, bool (H · W,)."""
        if self.candidate is None:
            return self.winner >= 0
        # The last value is what row -1 has: where nothing returned.
        return np.append(self.candidate, False)[self.winner]


def _to_rows(
    back_projection_name: str,
    points: ProjectedPoints,
    rows: Ints,
    count: int,
    asked: Bools | None,
    score: Float32s,
) -> Float32s:
    """Scores of all rows of a scan, float32 (count,): of some from pixels, of the others 0."""
    if asked is not None:
        score = np.where(asked, score, np.float32(0))
    result = np.zeros(count, np.float32)
    result[rows] = BACK_PROJECTIONS[back_projection_name](points, score)
    return result


@VIEWS.add("range")
@dataclass(frozen=True)
class RangeView(View):
    """Converts a scan into a range image; the same in training and in deployment.

    The nearest return wins a pixel; of equally near ones that of the lowest row.

    Args:
        grid: Rows and columns of the image.
        channels: Channels of a pixel, in order, as :meth:`Scan.channel` names it.
        back_projection: Name of the back-projection, by which points that lost their pixel get a
            score: ``nearest range``, ``copy`` or ``vote``. A Spec has it under the key
                ``back_projection``.
        fill_value: Replacement of a value that a scan lacks, by channel; 0 if not named.
        candidates: Points that are scored; None for all. The image shows the others all the same.

    Raises:
        InputError: An unknown back-projection.
    """

    grid: SphericalGrid
    channels: Channels = ("range", "x", "y", "z", "intensity")
    back_projection: str = "nearest range"
    fill_value: FillValues = field(default_factory=dict)
    candidates: Candidates | None = None

    def __post_init__(self) -> None:
        if self.back_projection not in BACK_PROJECTIONS:
            reason = f"no such back-projection: '{self.back_projection}'"
            remedy = f"Available: {', '.join(BACK_PROJECTIONS)}."
            raise InputError("back_projection", reason, remedy)

    @classmethod
    def of(cls, entry: Entry, channels: Channels, fill_value: FillValues, threads: int) -> Self:
        """The view that a Spec describes by its ``kind``, ``grid`` and ``way_back``.

        It uses one thread, even if more are permitted.

        Raises:
            InputError: Something that does not describe it.
        """
        parsers = {"kind": Entry.text, "grid": grid_at, "way_back": Entry.text}
        found = entry.record(parsers, required=("grid", "way_back"))
        return cls(found["grid"], channels, found["way_back"], fill_value)

    def as_dict(self) -> dict[str, Any]:
        """Its part of a Spec: ``kind``, ``grid`` and ``way_back``."""
        return {"kind": self.NAME, "grid": self.grid.as_dict(), "way_back": self.back_projection}

    @property
    def azimuth(self) -> Extent:
        """Its field of view: the grid's right and left bound, degrees counter-clockwise from x."""
        return self.grid.azimuth

    def with_candidates(self, candidates: Candidates) -> Self:
        """The same view, that gives scores to candidates alone."""
        return replace(self, candidates=candidates)

    def __call__(self, scan: Scan) -> RangeImage:
        """Views a scan."""
        shape = self.grid.rows, self.grid.columns
        pixel = self._pixel(scan)
        shown = _shown(pixel, scan.range, math.prod(shape))
        winner = shown["row"].astype(np.int64)
        return RangeImage(
            channel_image(scan, winner, self.channels, self.fill_value).reshape(-1, *shape),
            (winner >= 0).reshape(shape),
            pixel,
            winner,
            np.ascontiguousarray(shown["range"]).reshape(shape),
            scan.range,
            self.grid.is_full_circle,
            self.back_projection,
            None if self.candidates is None else self.candidates.among(scan),
        )

    def _pixel(self, scan: Scan) -> Ints:
        """Pixel of each row, int64 (N,); -1 for invalid rows and outside the grid."""
        valid = scan.valid
        if valid.all():
            return self.grid.pixel(scan.xyz)
        pixel = np.full(len(scan), -1)
        # take is four times faster than indexing for rows of three numbers.
        pixel[valid] = self.grid.pixel(scan.xyz.take(np.flatnonzero(valid), axis=0))
        return pixel


def _shown(pixel: Ints, distance: Float32s, size: int) -> NDArray[np.void]:
    """The point in each pixel: the nearest one, the lowest row of equally near ones.

    Args:
        pixel: Pixel of each point, int64 (N,); -1 for those in none.
        distance: Its range, float32 (N,), metres.
        size: M, the number of pixels.

    Returns:
        SHOWN_POINT (M,); NOTHING_SHOWN in empty pixels.
    """
    points = np.empty(len(pixel), SHOWN_POINT)
    points["row"], points["range"] = np.arange(len(pixel)), distance
    # One pixel more: the last takes the points that are in none, whose pixel is -1.
    shown = np.full(size + 1, NOTHING_SHOWN, "<i8")
    np.minimum.at(shown, pixel, points.view("<i8"))
    return shown[:-1].view(SHOWN_POINT)
