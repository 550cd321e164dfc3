"""The scans of a recording that are shown: when and where each was taken, how, and its labels."""

from collections.abc import Sequence
from contextlib import suppress
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.pictures.entities import SCAN, SHARE
from derain.pictures.palette import shades
from derain.scan import Bools, Float32s, Floats, Scan
from derain.sources.frame import Frame, times_of
from derain.sources.method import Method
from derain.sources.reader import FrameReader
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeImage, RangeView

# Scans, spread over the recording, that brightness and grid are taken from.
LOOKED_AT = 4

# From dark to bright; the colours of classes stand out from them.
GREYS = ("#404040", "#f0f0f0")

# Shade of scans without measured intensities.
EVEN_GREY = 0.35

# Pixels of range images count centimetres, which 16 bits hold up to 655 m.
PER_METRE = 100


@dataclass(frozen=True, eq=False)
class Selection:
    """Some scans of a source, in time order.

    Attributes:
        source: All scans.
        numbers: The places of the scans shown, ascending.

    Raises:
        InputError: No scan is shown.
    """

    source: Source
    numbers: Sequence[int]

    def __post_init__(self) -> None:
        if not self.numbers:
            reason = f"none of them is among the {len(self.source):,} scans"
            raise InputError("--frames", reason, "They count from 0; leave it out to show all.")

    @cached_property
    def frames(self) -> list[Frame]:
        """The frames shown."""
        return [self.source[number] for number in self.numbers]

    @cached_property
    def number_of(self) -> dict[str, int]:
        """The place of each shown frame in the source, by the frame's key."""
        return {frame.key: n for n, frame in zip(self.numbers, self.frames, strict=True)}

    def for_method(self, method: Method) -> Sequence[Frame]:
        """The frames to give to a method; one of several scans also gets frames not shown."""
        window = method.window
        if window.is_one_scan:
            return self.frames
        first, last = self.numbers[0], self.numbers[-1]
        return self.source[max(first - window.before, 0) : last + 1 + window.after]

    @cached_property
    def seconds(self) -> dict[str, float]:
        """Seconds from the first shown frame to each, by the frame's key.

        Empty where a frame has no time, or where the times do not ascend, as with several
        recordings.

        Raises:
            InputError: Times that are damaged.
        """
        times = times_of(self.frames)
        if times is None or any(before >= after for before, after in pairwise(times)):
            return {}
        return {f.key: time - times[0] for f, time in zip(self.frames, times, strict=True)}

    @cached_property
    def poses(self) -> dict[str, Floats]:
        """Pose of each shown frame, by the frame's key, float64 (4, 4), metres.

        A pose takes the sensor's frame to that of the first scan shown of its sequence: the viewer
        computes in float32, in which points far from the origin would tremble. Empty where a frame
        has no pose.

        Raises:
            InputError: Poses that are damaged.
        """
        to_first: dict[str, Floats] = {}
        placed = {}
        for frame in self.frames:
            pose = frame.pose
            if pose is None:
                return {}
            back = to_first.setdefault(frame.sequence, np.linalg.inv(pose).astype(np.float64))
            placed[frame.key] = back @ pose
        return placed

    @cached_property
    def look(self) -> "SensorLook":
        """The scale and view in which the scans are drawn."""
        return SensorLook.of(self.frames)


@dataclass(frozen=True)
class SensorLook:
    """The scale and view in which scans of one sensor are drawn.

    Attributes:
        brightest: Intensity that is drawn white, in the unit of the scans.
        farthest: Range that is drawn white, metres.
        view: Makes their range images; None where no scan has a valid point.
    """

    brightest: float
    farthest: float
    view: RangeView | None

    @classmethod
    def of(cls, frames: Sequence[Frame]) -> "SensorLook":
        """Takes the look from some scans of a recording.

        Args:
            frames: Its frames, one or more; those that cannot be read are skipped.
        """
        scans = []
        for frame in evenly_spaced(frames, LOOKED_AT):
            with suppress(InputError):  # reported when the frame is written
                scans.append(frame.read())
        measured = ((scan, scan.measured_intensity) for scan in scans)
        intensities = [values[scan.valid] for scan, values in measured if values is not None]
        ranges = [scan.range[scan.valid] for scan in scans]
        try:
            view = RangeView(fit_grid(scans).grid, channels=())
        except InputError:  # no valid point
            view = None
        return cls(_nearly_all(intensities), _nearly_all(ranges), view)

    def colours(self, scan: Scan) -> NDArray[np.uint8]:
        """Shades of grey by intensity, uint8 (N, 3); one shade where none was measured."""
        if scan.measured_intensity is None:
            return shades(GREYS, np.full(len(scan), EVEN_GREY))
        with np.errstate(invalid="ignore"):
            brightness = np.nan_to_num(scan.measured_intensity) / self.brightest
            return shades(GREYS, np.sqrt(np.clip(brightness, 0, 1)))

    def centimetres(self, seen: RangeImage) -> NDArray[np.uint16]:
        """The range of each pixel, uint16 (H, W), centimetres; 0 where nothing returned."""
        ranges = np.where(seen.valid, seen.nearest, 0) * PER_METRE
        return np.asarray(np.clip(ranges, 0, 65535).round().astype(np.uint16))


@dataclass(frozen=True, eq=False)
class LabelledRain:
    """Labels of the points of one scan.

    Attributes:
        rain: True for rain, bool (N,).
        known: False for points whose label is unknown, bool (N,).
    """

    rain: Bools
    known: Bools


@dataclass(frozen=True)
class Labels:
    """Labels that lie with scans.

    Attributes:
        card: Their data card.
        name: ``truth``, or ``teacher``.
    """

    card: DataCard
    name: str = "truth"

    @property
    def points(self) -> str:
        """Entity of the points labelled as rain, and of those whose label is unknown."""
        return f"{SCAN}/{self.name}"

    @property
    def share(self) -> str:
        """Entity of the share of rain in the points, per cent."""
        return f"{SHARE}/scan/{self.name}"

    def of(self, frame: Frame, scan: Scan) -> LabelledRain | None:
        """The labels of a scan; None where it has none.

        Args:
            frame: The frame.
            scan: The scan read from it.

        Raises:
            InputError: Labels that are damaged, or that are not on the data card.
        """
        if not frame.has_labels:
            return None
        labelled = FrameReader(self.card).with_labels(scan, frame)
        return LabelledRain(self.card.rain_of(labelled), ~self.card.unknown_of(labelled))


def _nearly_all(values: Sequence[Float32s]) -> float:
    """The 98th percentile, above 0; 1 of no values."""
    together = np.concatenate(values) if values else np.zeros(0)
    return max(float(np.percentile(together, 98)), 1e-6) if len(together) else 1.0
