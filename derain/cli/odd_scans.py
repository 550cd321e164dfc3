"""What is odd about a scan, given the method that is to clean it."""

import sys

from tqdm import tqdm

from derain.export.runtime import Derainer
from derain.filters import SSR, FilterDerainer
from derain.range_image import RangeView
from derain.scan import Scan

# Intensities this many times off the training data's are of another unit.
INTENSITY_MISMATCH = 30.0

# A larger share of points outside a model's grid are another sensor's, not a few strays.
MOST_OUTSIDE = 0.02


class Warnings:
    """Warns of what is odd about scans, of each subject once.

    A folder's scans have the same fault, with other numbers: the first one speaks for all.

    Args:
        method: What is to clean the scans.
    """

    def __init__(self, method: Derainer | FilterDerainer) -> None:
        self._method = method
        self._warned: set[str] = set()

    def __call__(self, scan: Scan) -> None:
        """Warns of a scan, its intensities being in the method's unit."""
        if isinstance(self._method, FilterDerainer):
            self._once("intensity", _no_intensity(scan, self._method))
        else:
            self._once("channels", _missing_channels(scan, self._method))
            self._once("intensity", _other_intensity(scan, self._method))
            self._once("grid", _outside_grid(scan, self._method))

    def _once(self, subject: str, warning: str | None) -> None:
        if warning is not None and subject not in self._warned:
            self._warned.add(subject)
            tqdm.write(f"derain: warning: {warning}", sys.stderr)


def _no_intensity(scan: Scan, derainer: FilterDerainer) -> str | None:
    """Whether a filter of intensity gets none."""
    if scan.intensity is None and isinstance(derainer.filter, SSR):
        return f"no intensity: {derainer.filter.name} finds nothing without"
    return None


def _missing_channels(scan: Scan, derainer: Derainer) -> str | None:
    """Which channels of the model a scan has not got."""
    missing = derainer.spec.missing_channels(scan)
    if not missing:
        return None
    means = ", ".join(f"{mean:.3g}" for mean in missing.values())
    return f"no {', '.join(missing)}: the mean of {derainer.spec.data}, {means}, stands in"


def _other_intensity(scan: Scan, derainer: Derainer) -> str | None:
    """What is odd about a scan's intensities, given the data that the model was trained on."""
    spec = derainer.spec
    if scan.intensity is None:
        return None
    valid = scan.valid
    mean = float(scan.intensity[valid].mean(dtype="float64")) if valid.any() else 0.0
    expected = spec.mean_intensity
    comparable = mean > 0 and expected > 0
    if comparable and not 1 / INTENSITY_MISMATCH < mean / expected < INTENSITY_MISMATCH:
        return (
            f"mean intensity {mean:.3g}, but {expected:.3g} where the model was trained "
            f"(unit {spec.intensity_unit}): see --intensity-scale"
        )
    return None


def _outside_grid(scan: Scan, derainer: Derainer) -> str | None:
    """What of a scan the model's range image does not show."""
    xyz = scan.xyz[scan.valid]
    if not isinstance(derainer.view, RangeView) or not len(xyz):
        return None
    outside = float((derainer.view.grid.pixel(xyz) < 0).mean())
    if outside <= MOST_OUTSIDE:
        return None
    return f"{outside:.0%} of the points lie outside the grid of {derainer.spec.data}, and stay"
