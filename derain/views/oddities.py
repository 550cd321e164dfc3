"""What is odd about a scan, given the method that judges it."""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.evaluation.intensity_rule import OneLineRule
from derain.filters import SSR, PointFilter
from derain.scan import FEWEST_ALIKE, PartialHeader, Scan
from derain.spec import Spec
from derain.views.full_scale import FULL_SCALES

# Intensities this many times off the training data's are of another unit.
INTENSITY_MISMATCH = 30.0

# Units of intensity that tell its full scale.
SPANS = {f"0..{scale:g}": scale for scale in FULL_SCALES}

# What of a scan its full scale is read from: above it lie glints, and damaged values.
FULL_SCALE_PERCENTILE = 99

# A larger share of points outside a model's grid are another sensor's, not a few strays.
MOST_OUTSIDE = 0.02

# Share of rain in the heaviest that is known: 12 % of the points of WADS are snow, and 17 % rain in
# the heavy rain of REHEARSE-3D. A method that takes twice as much has mistaken sensor or unit.
HEAVIEST_RAIN = 0.17
MOST_RAIN = 2 * HEAVIEST_RAIN

# What a method judges by, as far as a scan may not suit it; None for what suits every scan.
Judge = Spec | PointFilter | OneLineRule | None


@dataclass(frozen=True)
class Oddity:
    """One thing that is odd about a scan.

    Attributes:
        kind: What it is, in the same words for every scan that has it.
        detail: How it shows in this one.
    """

    kind: str
    detail: str


def oddities(scan: Scan, judge: Judge) -> Iterator[Oddity]:
    """What is odd about a scan before it is judged.

    Args:
        scan: The scan, its intensities in the unit of the method. One without a point that can be
            judged is not odd.
        judge: What the method judges by.
    """
    if judge is None or not scan.valid.any():
        return
    if isinstance(judge, Spec):
        yield from _missing_channels(scan, judge)
        yield from _intensity_unlike_training(scan, judge)
    elif isinstance(judge, SSR | OneLineRule):
        if scan.measured_intensity is None:
            yield Oddity(_lack(scan), f"{_lack_in_detail(scan)}: nothing can be found without")
        elif isinstance(judge, SSR):
            yield from _of_another_scale(scan, SSR.FULL_SCALE, "ssr")


def outside_view(scan: Scan, judged: NDArray[np.bool_], judge: Spec) -> Iterator[Oddity]:
    """Whether much of a scan lies outside what a model sees.

    Only who judged the scan can say: to project it once more would take as long as the view. A
    bench does not, whose methods give no more than what they call rain, and whose recall counts
    the rain that they do not see as missed.

    Args:
        scan: The scan.
        judged: Rows that the model judged, bool (N,).
        judge: The model's Spec.
    """
    valid = scan.valid
    outside = float((~judged[valid]).mean()) if valid.any() else 0.0
    if outside > MOST_OUTSIDE:
        yield Oddity(
            "points outside the grid",
            f"{outside:.0%} of the points lie outside the grid of {judge.data}, and stay",
        )


def much_removed(share: float) -> Iterator[Oddity]:
    """Whether a method calls more of a scan rain than rain ever was.

    Args:
        share: Share of the points that can be judged which it calls rain.
    """
    if share > MOST_RAIN:
        yield Oddity(
            f"more than {MOST_RAIN:.0%} called rain",
            f"{share:.0%} of the points are called rain, where the heaviest rain has "
            f"{HEAVIEST_RAIN:.0%}: the method may not suit the sensor",
        )


def left_out(scan: Scan) -> Iterator[Oddity]:
    """Whether a scan's file holds what is not written with the cleaned scan."""
    if isinstance(scan.header, PartialHeader) and scan.header.left_out:
        yield Oddity(
            "parts of the file that are not written",
            f"the cleaned file is without its {', '.join(scan.header.left_out)}",
        )


def _missing_channels(scan: Scan, spec: Spec) -> Iterator[Oddity]:
    """Which channels of the model a scan has not got."""
    for name, mean in spec.missing_channels(scan).items():
        lack, detail = f"no {name}", f"no {name}"
        if name == "intensity":
            lack, detail = _lack(scan), _lack_in_detail(scan)
        yield Oddity(lack, f"{detail}: the mean of {spec.data}, {mean:.3g}, stands in")


def _lack(scan: Scan) -> str:
    """What a scan without a measured intensity has instead."""
    return "no intensity" if scan.intensity is None else "intensity not measured"


def _lack_in_detail(scan: Scan) -> str:
    if scan.intensity is None:
        return "no intensity"
    values = scan.intensity[scan.valid]
    if values.min() == values.max():
        return f"intensity {values[0]:g} at every point, so that it was not measured"
    return "no intensity is a number that sensors measure"


def _intensity_unlike_training(scan: Scan, spec: Spec) -> Iterator[Oddity]:
    """Whether a scan's intensities are of another unit than a model's training data."""
    intensity, expected = scan.measured_intensity, spec.mean_intensity
    if intensity is None or expected <= 0:
        return
    mean = float(intensity[scan.valid].mean(dtype="float64"))
    if mean > 0 and not 1 / INTENSITY_MISMATCH < mean / expected < INTENSITY_MISMATCH:
        yield Oddity(
            _other_unit(mean < expected),
            f"mean intensity {mean:.3g}, but {expected:.3g} where the model was trained "
            f"(unit {spec.intensity_unit}): see --intensity-scale",
        )
    elif full_scale := SPANS.get(spec.intensity_unit):
        yield from _of_another_scale(scan, full_scale, spec.data)


def _of_another_scale(scan: Scan, expected: float, whose: str) -> Iterator[Oddity]:
    """Whether a scan's intensities have another full scale than expected: 1, 255 or 65,535."""
    assert scan.intensity is not None
    intensity = scan.intensity[scan.valid]
    if len(intensity) < FEWEST_ALIKE:  # so few may all be dark
        return
    bright = np.percentile(intensity, FULL_SCALE_PERCENTILE)
    scale = next((scale for scale in FULL_SCALES if bright <= scale), FULL_SCALES[-1])
    if scale != expected:
        yield Oddity(
            _other_unit(scale < expected),
            f"intensities of 0..{scale:g}, but 0..{expected:g} for {whose}: see --intensity-scale",
        )


def _other_unit(smaller: bool) -> str:
    return f"intensity of a {'smaller' if smaller else 'larger'} unit"
