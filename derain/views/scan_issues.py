"""Possible faults of a scan; each method chooses those that matter to it."""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass

import numpy as np

from derain.scan import FEWEST_ALIKE, Bools, Scan
from derain.views.full_scale import FULL_SCALES

# Intensities this many times off the training data's are of another unit.
INTENSITY_MISMATCH = 30.0

# Full scale of intensities, by the units that determine it.
SCALE_OF_UNIT = {f"0..{scale:g}": scale for scale in FULL_SCALES}

# What of a scan its full scale is read from: above it lie glints, and damaged values.
FULL_SCALE_PERCENTILE = 99

# A larger share of points outside a model's grid are another sensor's, not a few strays.
MOST_OUTSIDE = 0.02

# Share of rain in the heaviest that is known: 12 % of the points of WADS are snow, and 17 % rain in
# the heavy rain of REHEARSE-3D. A method that takes more than twice as much has mistaken the sensor
# or the unit of its intensity.
HEAVIEST_RAIN = 0.17
MOST_RAIN = 0.35


@dataclass(frozen=True)
class ScanIssue:
    """One thing about a scan that may not suit a method.

    Attributes:
        kind: Kind of issue, with the same text for every scan.
        detail: Description of the issue in this scan.
    """

    kind: str
    detail: str


def missing_channels(scan: Scan, means: Mapping[str, float], data: str) -> Iterator[ScanIssue]:
    """Yields an issue for each channel of a model that a scan lacks.

    Args:
        scan: The scan.
        means: The model's channels, and the means that replace those that a scan lacks.
        data: Name of the data that the means are of.
    """
    if not scan.valid.any():
        return
    for name, mean in means.items():
        if scan.channel(name) is None:
            lack = _lack(scan) if name == "intensity" else f"no {name}"
            yield ScanIssue(lack, f"{lack}: replaced by the mean of {data}, {mean:.3g}")


def missing_intensity(
    scan: Scan,
    consequence: str = "nothing can be found without it; name its column, or use default or dror",
) -> Iterator[ScanIssue]:
    """Yields an issue if a scan lacks the intensity that a method needs.

    Args:
        scan: The scan.
        consequence: Its effect on the method.
    """
    if scan.measured_intensity is None and scan.valid.any():
        lack = _lack(scan)
        yield ScanIssue(lack, f"{lack}: {consequence}")


def intensity_unlike_training(scan: Scan, mean: float, unit: str, data: str) -> Iterator[ScanIssue]:
    """Yields an issue if a scan's intensities have another unit than a model's training data.

    Args:
        scan: The scan.
        mean: Mean intensity of the training data; 0 for a model that sees none.
        unit: Unit of the training data's intensity.
        data: Name of the training data.
    """
    if mean <= 0 or scan.measured_intensity is None:
        return
    intensity = scan.measured_intensity[scan.valid]
    found = float(intensity.mean(dtype="float64")) if len(intensity) else 0.0
    if found > 0 and not 1 / INTENSITY_MISMATCH < found / mean < INTENSITY_MISMATCH:
        yield ScanIssue(
            _other_unit(found < mean),
            f"mean intensity {found:.3g}, but {mean:.3g} where the model was trained "
            f"(unit {unit}): see --intensity-scale or Scan.with_intensity_times",
        )
    elif full_scale := SCALE_OF_UNIT.get(unit):
        yield from intensity_of_another_scale(scan, full_scale, data)


def intensity_of_another_scale(scan: Scan, expected: float, whose: str) -> Iterator[ScanIssue]:
    """Yields an issue if a scan's intensities have another full scale than expected.

    Args:
        scan: The scan.
        expected: One of FULL_SCALES: 1, 255 or 65,535.
        whose: Name of the method or the data that expects it.
    """
    if scan.measured_intensity is None:
        return
    intensity = scan.measured_intensity[scan.valid]
    if len(intensity) < FEWEST_ALIKE:  # so few may all be dark
        return
    bright = np.percentile(intensity, FULL_SCALE_PERCENTILE)
    scale = next((scale for scale in FULL_SCALES if bright <= scale), FULL_SCALES[-1])
    if scale != expected:
        yield ScanIssue(
            _other_unit(scale < expected),
            f"intensities of 0..{scale:g}, but 0..{expected:g} for {whose}: see --intensity-scale "
            "or Scan.with_intensity_times",
        )


def outside_view(scan: Scan, judged: Bools, data: str) -> Iterator[ScanIssue]:
    """Yields an issue if much of a scan lies outside the field of view of a model.

    The caller passes the judged rows: to project the scan again would take as long as the view. A
    bench does not call this: its methods return only the rain, and its recall counts the rain
    outside the view as missed.

    Args:
        scan: The scan.
        judged: Rows that the model judged, bool (N,).
        data: Name of the data that the model's grid is for.
    """
    valid = scan.valid
    outside = float((~judged[valid]).mean()) if valid.any() else 0.0
    if outside > MOST_OUTSIDE:
        detail = f"{outside:.0%} of the points lie outside the grid of {data}, and stay"
        yield ScanIssue("points outside the grid", detail)


def much_removed(share: float) -> Iterator[ScanIssue]:
    """Yields an issue if a method calls more of a scan rain than in any rain.

    Args:
        share: Share of the points that can be judged which it calls rain.
    """
    if share > MOST_RAIN:
        yield ScanIssue(
            f"more than {MOST_RAIN:.0%} called rain",
            f"{share:.0%} of the points are called rain, and the heaviest rain has "
            f"{HEAVIEST_RAIN:.0%}: the method may not suit the sensor",
        )


def intensity_in_places(scan: Scan, judged: Bools) -> Iterator[ScanIssue]:
    """Yields an issue if some points of a scan have no possible intensity, and others have.

    Args:
        scan: The scan.
        judged: Rows that the method judged, bool (N,).
    """
    lacking = scan.lacks_intensity
    if lacking.any():
        result = "judged without it" if judged[lacking].any() else "not judged, and stay"
        detail = f"no possible intensity at {np.count_nonzero(lacking):,} points: they are {result}"
        yield ScanIssue("no intensity in places", detail)


def no_points(scan: Scan) -> Iterator[ScanIssue]:
    """Yields an issue if a scan holds no points, which is valid but hardly intended."""
    if not len(scan):
        yield ScanIssue("no points", "it holds no points: the file may be a copy that failed")


def left_out(scan: Scan) -> Iterator[ScanIssue]:
    """Yields an issue if a scan's file has parts that are not written with the cleaned scan."""
    if scan.left_out:
        detail = f"the cleaned file is without its {', '.join(scan.left_out)}"
        yield ScanIssue("parts of the file that are not written", detail)


def _lack(scan: Scan) -> str:
    """What a scan without a measured intensity lacks."""
    if scan.intensity is None:
        return "no intensity"
    return "intensity not measured (one value at every point, or none that is possible)"


def _other_unit(smaller: bool) -> str:
    return f"intensity of a {'smaller' if smaller else 'larger'} unit"
