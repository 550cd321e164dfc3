"""How the scans of a recording are drawn: one brightness and one range image for all of them."""

from collections.abc import Sequence
from contextlib import suppress
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

# Scans, spread over the recording, that brightness and grid are taken from.
LOOKED_AT = 4

# From dark to bright; the colours of classes stand out from them.
GREYS = ("#404040", "#f0f0f0")

# Shade of scans without intensities.
EVEN_GREY = 0.35

# Pixels of range images count centimetres, which 16 bits hold up to 655 m.
PER_METRE = 100


@dataclass(frozen=True)
class SensorLook:
    """How scans of one sensor are drawn.

    Attributes:
        brightest: Intensity that is drawn white, in the unit of the scans.
        farthest: Range that is drawn white, metres.
        view: Makes their range images; None where no scan has a valid point.
    """

    brightest: float
    farthest: float
    view: RangeView | None

    @classmethod
    def of(cls, frames: Sequence[Frame]) -> Self:
        """Takes the look from some scans of a recording.

        Args:
            frames: Its frames, one or more; those that cannot be read are skipped.
        """
        scans = []
        for frame in evenly_spaced(frames, LOOKED_AT):
            with suppress(InputError):  # reported when the frame is written
                scans.append(frame.read())
        intensities = [s.intensity[s.valid] for s in scans if s.intensity is not None]
        ranges = [scan.range[scan.valid] for scan in scans]
        try:
            view = RangeView(fit_grid(scans).grid, channels=())
        except InputError:  # no valid point
            view = None
        return cls(_nearly_all(intensities), _nearly_all(ranges), view)

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


def _nearly_all(values: Sequence[NDArray[np.float32]]) -> float:
    """The 98th percentile, above 0; 1 of no values."""
    together = np.concatenate(values) if values else np.zeros(0)
    return max(float(np.percentile(together, 98)), 1e-6) if len(together) else 1.0
