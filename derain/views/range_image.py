"""The range view: a scan as the image that the sensor saw."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from functools import partial
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.documents import Entry
from derain.scan import Scan
from derain.views.back_projection import BACK_PROJECTIONS, ProjectedPoints
from derain.views.channels import filled_values
from derain.views.registry import VIEWS
from derain.views.spherical_grid import SphericalGrid, grid_at
from derain.views.view import IGNORED, BackProjection, SeenScan, View


@dataclass(frozen=True, eq=False)
class RangeImage(SeenScan):
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
        way_back: Name of the back-projection, by which points that are not shown get a score.
    """

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

    def back_projection(self) -> BackProjection:
        """What gives points scores of pixels as ``way_back`` says, and 0 to rows off the grid."""
        judged = np.flatnonzero(self.judged)
        points = ProjectedPoints(
            self.pixel[judged],
            self.range[judged],
            self._nearest().reshape(self.valid.shape),
            self.wraps,
        )
        return partial(_to_rows, self.way_back, points, judged, len(self.pixel))

    @staticmethod
    def pack(seen: Sequence["RangeImage"]) -> dict[str, NDArray[Any]]:
        """Inputs of several scans on one grid as one batch."""
        return {
            "image": np.stack([one.image for one in seen]),
            "valid": np.stack([one.valid[None] for one in seen]),
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
    result[judged] = BACK_PROJECTIONS[way_back](points, score)
    return result


@VIEWS.add("range")
@dataclass(frozen=True)
class RangeView(View):
    """How a scan becomes a range image; the same in training and in deployment.

    The nearest return wins a pixel; of equally near ones that of the lowest row.

    Args:
        grid: Rows and columns of the image.
        channels: What a pixel holds, in order, as :meth:`Scan.channel` names it.
        way_back: Name of the back-projection, by which points that lost their pixel get a score:
            ``nearest range``, ``copy`` or ``vote``. It is called so in options and in Specs, which
            users type and files hold.
        stand_in: What stands in for a value that a scan lacks, by channel; 0 if not named.

    Raises:
        InputError: An unknown back-projection.
    """

    grid: SphericalGrid
    channels: tuple[str, ...] = ("range", "x", "y", "z", "intensity")
    way_back: str = "nearest range"
    stand_in: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if self.way_back not in BACK_PROJECTIONS:
            raise InputError(
                "way_back",
                f"no such back-projection: '{self.way_back}'",
                f"Known are {', '.join(BACK_PROJECTIONS)}.",
            )

    @classmethod
    def of(
        cls, entry: Entry, channels: tuple[str, ...], stand_in: Mapping[str, float], threads: int
    ) -> Self:
        """The view that a Spec describes by its ``kind``, ``grid`` and ``way_back``.

        It takes one thread, whatever it may use.

        Raises:
            InputError: Something that does not describe it.
        """
        found = entry.record(
            {"kind": Entry.text, "grid": grid_at, "way_back": Entry.text},
            required=("grid", "way_back"),
        )
        return cls(found["grid"], channels, found["way_back"], stand_in)

    def as_dict(self) -> dict[str, Any]:
        """Its part of a Spec: ``kind``, ``grid`` and ``way_back``."""
        return {"kind": self.NAME, "grid": self.grid.as_dict(), "way_back": self.way_back}

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
