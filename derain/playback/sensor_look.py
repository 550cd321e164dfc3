"""How the scans of a recording are drawn: one brightness and one range image for all of them."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.pictures.palette import shades
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.spread import evenly_spaced
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeImage, RangeView

# Of so many scans, spread over the recording, brightness and grid are taken.
LOOKED_AT = 4

# From dark to bright, which colours stand out from.
GREYS = ("#404040", "#f0f0f0")

# Where a scan has no intensities.
EVEN_GREY = 0.35

# Bytes of a point: three coordinates in float32 with its class, and its shade; what Rerun's
# compression makes of them. Where points stand twice in a scan, it becomes less.
POINT, SHADE = 13, 5

# Bytes of a pixel of the range image.
PIXEL = 2

# Unit of range images, which 16 bits hold up to 655 m.
PER_METRE = 100


@dataclass(frozen=True)
class SensorLook:
    """How scans of one sensor are drawn.

    Attributes:
        points: Points of a scan that can be judged, on average.
        brightest: Intensity that is shown as white, in the unit of the scans.
        farthest: Range that is shown as white, metres.
        view: Their range image; None where there is nothing to make one of.
    """

    points: int
    brightest: float
    farthest: float
    view: RangeView | None

    @classmethod
    def of(cls, frames: Sequence[Frame]) -> Self:
        """How the scans of a recording are drawn, by some of them.

        Args:
            frames: Its frames, one or more; those that cannot be read are passed over.
        """
        scans = list(_readable(evenly_spaced(frames, LOOKED_AT)))
        intensities = [s.intensity[s.valid] for s in scans if s.intensity is not None]
        ranges = [scan.range[scan.valid] for scan in scans]
        try:
            view = RangeView(fit_grid(scans).grid, channels=())
        except InputError:  # not one point that can be judged
            view = None
        return cls(
            points=round(sum(map(len, ranges)) / max(len(scans), 1)),
            brightest=_nearly_all(intensities),
            farthest=_nearly_all(ranges),
            view=view,
        )

    def expected_bytes(self, scans: int, methods: int) -> int:
        """About how large a file becomes.

        Every method writes the points again, those that it keeps and those that it removes apart.

        Args:
            scans: How many are shown.
            methods: How many methods judge them.
        """
        pixels = 0 if self.view is None else self.view.grid.rows * self.view.grid.columns
        return scans * (self.points * (SHADE + POINT * (1 + methods)) + PIXEL * pixels)

    def colours(self, scan: Scan) -> NDArray[np.uint8]:
        """Shades of grey by intensity, uint8 (N, 3)."""
        if scan.intensity is None:
            return shades(GREYS, np.full(len(scan), EVEN_GREY))
        with np.errstate(invalid="ignore"):
            brightness = np.nan_to_num(scan.intensity) / self.brightest
            return shades(GREYS, np.sqrt(np.clip(brightness, 0, 1)))

    def centimetres(self, seen: RangeImage) -> NDArray[np.uint16]:
        """The range of each pixel, uint16 (H, W), centimetres; 0 where nothing returned."""
        ranges = np.where(seen.valid, seen.nearest, 0) * PER_METRE
        pixels: NDArray[np.uint16] = np.clip(ranges, 0, 65535).round().astype(np.uint16)
        return pixels


def _readable(frames: Sequence[Frame]) -> list[Scan]:
    scans = []
    for frame in frames:
        try:
            scans.append(frame.read())
        except InputError:  # it is told of when its turn comes
            continue
    return scans


def _nearly_all(values: Sequence[NDArray[np.float32]]) -> float:
    """What 98 of a hundred values do not exceed, above 0."""
    together = np.concatenate(values) if values else np.zeros(0)
    return max(float(np.percentile(together, 98)), 1e-6) if len(together) else 1.0
