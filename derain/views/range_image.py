"""The range view: a scan as the image that the sensor saw."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, ClassVar, Self

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import Entry
from derain.scan import Scan
from derain.views.back_projection import WAYS_BACK, ProjectedPoints
from derain.views.channels import filled_values
from derain.views.spherical_grid import SphericalGrid, grid_at
from derain.views.view import IGNORED, WayToRows

CHANNELS = ("range", "x", "y", "z", "intensity")


@dataclass(frozen=True, eq=False)
class RangeImage:
    """One scan as a network on images sees it.

    Attributes:
        image: The view's channels, each in its own unit, float32 (C, H, W); 0 where nothing
            returned.
        valid: True where something returned, bool (H, W).
        pixel: Pixel of each row of the scan, int64 (N,); -1 for invalid rows and for points
            outside the grid.
        winner: Row of the scan that each pixel shows, int64 (H · W,); -1 where nothing returned.
        range: Range of each row of the scan, float32 (N,), metres.
        wraps: True where the last column is the neighbour of the first.
        way_back: How points that are not shown get a score.
    """

    VARYING: ClassVar[str | None] = None

    image: NDArray[np.float32]
    valid: NDArray[np.bool_]
    pixel: NDArray[np.int64]
    winner: NDArray[np.int64]
    range: NDArray[np.float32]
    wraps: bool
    way_back: str

    @property
    def size(self) -> int:
        """H · W, the number of pixels that the network scores."""
        return self.valid.size

    @property
    def judged(self) -> NDArray[np.bool_]:
        """True for rows of the scan that lie on the grid, bool (N,)."""
        return self.pixel >= 0

    @property
    def hidden(self) -> NDArray[np.bool_]:
        """True for points on the grid whose pixel shows a nearer return, bool (N,)."""
        return self.judged & (self.range > self._nearest().take(self.pixel))

    def inputs(self) -> dict[str, NDArray[Any]]:
        """The network's inputs, a batch of one: image (1, C, H, W) and valid (1, 1, H, W)."""
        return {"image": self.image[None], "valid": self.valid[None, None]}

    def target(self, rain: NDArray[np.bool_]) -> NDArray[np.int64]:
        """What the network is to say of each pixel.

        Args:
            rain: Truth for every row of the scan, bool (N,).

        Returns:
            1 for rain, 0 for everything else, ``IGNORED`` where nothing returned, int64 (H · W,).
        """
        result = np.full(self.size, IGNORED)
        shown = self.winner >= 0
        result[shown] = rain[self.winner[shown]]
        return result

    def back(self, score: NDArray[np.float32]) -> NDArray[np.float32]:
        """Carries the network's scores back to every row of the scan.

        Args:
            score: One value per pixel, float32 (H · W,).

        Returns:
            One value per row of the scan in its order, float32 (N,); 0 for invalid rows and for
            points outside the grid, which nobody judged.
        """
        return self.way_to_rows()(score)

    def way_to_rows(self) -> WayToRows:
        """What :meth:`back` does, without the image."""
        judged = np.flatnonzero(self.judged)
        points = ProjectedPoints(
            self.pixel[judged],
            self.range[judged],
            self._nearest().reshape(self.valid.shape),
            self.wraps,
        )
        return partial(_to_rows, self.way_back, points, judged, len(self.pixel))

    @staticmethod
    def pack(views: Sequence["RangeImage"]) -> dict[str, NDArray[Any]]:
        """Inputs of several scans on one grid as one batch."""
        return {
            "image": np.stack([view.image for view in views]),
            "valid": np.stack([view.valid[None] for view in views]),
        }

    def _nearest(self) -> NDArray[np.float32]:
        """Range that each pixel shows, float32 (H · W,); infinite where nothing returned."""
        nearest = np.full(self.size, np.inf, np.float32)
        shown = self.winner >= 0
        nearest[shown] = self.range[self.winner[shown]]
        return nearest


def _to_rows(
    way_back: str,
    points: ProjectedPoints,
    judged: NDArray[np.int64],
    rows: int,
    score: NDArray[np.float32],
) -> NDArray[np.float32]:
    result = np.zeros(rows, np.float32)
    result[judged] = WAYS_BACK[way_back](points, score)
    return result


@dataclass(frozen=True)
class RangeView:
    """How a scan becomes a range image; the same in training and in deployment.

    The nearest return wins a pixel; of equally near ones that of the lowest row.

    Args:
        grid: Rows and columns of the image.
        channels: What a pixel holds, in order, as :meth:`Scan.channel` names it.
        way_back: How points that lost their pixel get a score: ``nearest range``, ``copy`` or
            ``vote``.
        stand_in: What stands in for a value that a scan lacks, by channel; 0 if not named.

    Raises:
        InputError: An unknown way back.
    """

    KIND: ClassVar[str] = "range"

    grid: SphericalGrid
    channels: tuple[str, ...] = CHANNELS
    way_back: str = "nearest range"
    stand_in: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.way_back not in WAYS_BACK:
            raise InputError(
                "way_back",
                f"no such way back: '{self.way_back}'",
                f"Known are {', '.join(WAYS_BACK)}.",
            )

    @classmethod
    def of(cls, entry: Entry, channels: tuple[str, ...], stand_in: Mapping[str, float]) -> Self:
        """The view that a Spec describes by its ``kind``, ``grid`` and ``way_back``.

        Raises:
            InputError: Something that does not describe it.
        """
        found = entry.record(
            {"kind": Entry.text, "grid": grid_at, "way_back": Entry.text},
            required=("grid", "way_back"),
        )
        return cls(found["grid"], channels, found["way_back"], stand_in)

    @property
    def azimuth(self) -> tuple[float, float]:
        """What it sees: the grid's right and left bound, degrees counter-clockwise from x."""
        return self.grid.azimuth

    def __call__(self, scan: Scan) -> RangeImage:
        """Views a scan."""
        grid, distance = self.grid, scan.range
        valid = np.flatnonzero(scan.valid)
        pixel = np.full(len(scan), -1)
        # take is four times faster than indexing for rows of three numbers.
        pixel[valid] = grid.pixel(scan.xyz.take(valid, axis=0))
        winner = _winners(pixel, distance, grid.rows * grid.columns)
        shown = np.flatnonzero(winner >= 0)
        image = np.zeros((len(self.channels), len(winner)), np.float32)
        image[:, shown] = filled_values(scan, winner[shown], self.channels, self.stand_in)
        return RangeImage(
            image.reshape(len(self.channels), grid.rows, grid.columns),
            (winner >= 0).reshape(grid.rows, grid.columns),
            pixel,
            winner,
            distance,
            grid.is_full_circle,
            self.way_back,
        )


def _winners(
    pixel: NDArray[np.int64], distance: NDArray[np.float32], size: int
) -> NDArray[np.int64]:
    """Row of the nearest point in each pixel, the lowest of equally near ones, int64 (size,)."""
    rows = np.flatnonzero(pixel >= 0)
    nearest = np.full(size, np.inf, np.float32)
    np.minimum.at(nearest, pixel[rows], distance[rows])
    rows = rows[distance[rows] == nearest[pixel[rows]]]
    winner = np.full(size, -1)
    # Where a pixel is written several times the last stays, which backwards is the lowest row.
    winner[pixel[rows[::-1]]] = rows[::-1]
    return winner
