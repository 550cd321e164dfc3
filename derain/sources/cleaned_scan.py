"""Results of cleaning, scan by scan as in records, and their totals."""

import base64
import math
import zlib
from collections import defaultdict
from collections.abc import Mapping
from dataclasses import asdict, dataclass, field
from datetime import UTC, datetime
from pathlib import PurePosixPath
from typing import Any

import numpy as np

from derain.errors import InputError, counted, printable
from derain.jobs.unit import Record
from derain.sources.frame import Frame
from derain.views.scan_issues import ScanIssue
from derain.weather.record import WeatherRecord
from derain.weather.scan_weather import ScanWeather

# Seconds from which on times are those of Unix: no recording takes thirty years.
UNIX_TIMES_FROM = 1e9


@dataclass(frozen=True)
class CleanedScan:
    """The result of cleaning one scan.

    Attributes:
        scan: Its file.
        points: Number of points.
        valid: Number of points that can be judged.
        rain: Number of removed points.
        share_removed: Share of ``rain`` in ``valid``.
        not_known: Number of valid points that the method is not sure of; None for a method that
            does not report doubt.
        milliseconds: Time of each stage.
        warnings: Warnings about the scan.
        weather: Its weather; None unless every scan is measured.
    """

    scan: str
    points: int
    valid: int
    rain: int
    share_removed: float
    not_known: int | None
    milliseconds: dict[str, float]
    warnings: list[str]
    weather: WeatherRecord | None = None

    def __str__(self) -> str:
        name, total = printable(self.scan), sum(self.milliseconds.values())
        unsure = "" if self.not_known is None else f", {self.share_not_known:.1%} not known"
        weather = "" if self.weather is None else f", {self.weather}"
        return (
            f"{name}: {counts(self.points, self.valid, self.rain)}{unsure}{weather}, {total:.0f} ms"
        )

    @property
    def share_not_known(self) -> float:
        """Share of ``not_known`` in ``valid``."""
        return (self.not_known or 0) / max(self.valid, 1)


@dataclass(frozen=True, eq=False)
class ScanOutcome:
    """The outcome of one scan of a source.

    Attributes:
        frame: The scan.
        issues: Warnings about it.
        cleaned: Its results; None if it could not be cleaned.
        seconds: Its time, seconds; None if unknown.
        packed: The weather in the scan, as text, for its numbers take 100 kB and many outcomes may
            wait at once; None if it was not measured.
        error: The error of a scan that could not be cleaned; None if it was cleaned.
        recording: The unbroken recording that it is of, where only its unit shows that.
        uploaded: Sizes and versions of what its unit uploaded, by path, with the last scan of it.
        was_there: True if an earlier run had cleaned it.
    """

    frame: Frame
    issues: list[ScanIssue]
    cleaned: CleanedScan | None = None
    seconds: float | None = None
    packed: str | None = None
    error: InputError | None = None
    recording: str | None = None
    uploaded: Mapping[str, str] = field(default_factory=dict)
    was_there: bool = False

    @property
    def figures(self) -> CleanedScan:
        """The figures of a cleaned scan."""
        assert self.cleaned is not None
        return self.cleaned

    @property
    def measured(self) -> ScanWeather | None:
        """The weather in the scan; None if it was not measured."""
        return None if self.packed is None else unpacked(self.packed)

    def to_json(self) -> dict[str, Any]:
        """The outcome of a cleaned scan as the record of its unit has it."""
        cleaned = asdict(self.figures)
        del cleaned["weather"]  # a recording's weather depends on the scans before
        return {
            "cleaned": cleaned,
            "key": self.frame.key,
            "seconds": self.seconds,
            "measured": self.packed,
            "recording": self.recording,
            "uploaded": dict(self.uploaded),
        }


class CleanedTotals:
    """Adds up the records of units.

    Attributes:
        scans: Number of cleaned scans.
        points: Number of their points.
        valid: Number of points that can be judged.
        rain: Number of removed points.
        by_hour: The weather of the measured scans of each hour, by its name: a date and an hour in
            UTC, or else the recording and the hour in it.
    """

    def __init__(self) -> None:
        self.scans = self.points = self.valid = self.rain = 0
        self.by_hour: dict[str, ScanWeather] = defaultdict(ScanWeather.none)

    def add(self, record: Record) -> None:
        """Adds the scans of a unit."""
        for scan in record.results:
            self.scans += 1
            cleaned = scan["cleaned"]
            self.points += cleaned["points"]
            self.valid += cleaned["valid"]
            self.rain += cleaned["rain"]
            if scan["measured"] is not None:
                hour = _hour(scan["seconds"], PurePosixPath(record.unit).parent.as_posix())
                self.by_hour[hour] += unpacked(scan["measured"])

    def worst_hours(self, most: int = 3) -> list[tuple[str, ScanWeather]]:
        """The hours with the shortest visibility, the worst first.

        Args:
            most: The largest number.
        """
        known = [each for each in self.by_hour.items() if each[1].visibility.known]
        return sorted(known, key=lambda each: each[1].visibility.shown)[:most]

    def __str__(self) -> str:
        return f"{counted(self.scans, 'scan')}: {counts(self.points, self.valid, self.rain)}"


def counts(points: int, valid: int, rain: int) -> str:
    """The number of points, of those that can be judged, and of those that are rain."""
    return (
        f"{points:,} points, {valid:,} valid, {rain:,} of rain ({rain / max(valid, 1):.1%} of the "
        "valid)"
    )


def packed(weather: ScanWeather) -> str:
    """A weather as text: most of its numbers are 0."""
    return base64.b64encode(zlib.compress(weather.ends.astype("<i8").tobytes())).decode("ascii")


def unpacked(text: str) -> ScanWeather:
    """The weather that :func:`packed` made a text of."""
    shape = ScanWeather.none().ends.shape
    ends = np.frombuffer(zlib.decompress(base64.b64decode(text)), "<i8").reshape(shape)
    return ScanWeather(ends.astype(np.int64))


def _hour(seconds: float | None, recording: str) -> str:
    """The hour of a time, by its date, or within its recording."""
    prefix = "" if recording == "." else f"{recording}, "
    if seconds is None or not math.isfinite(seconds):
        return f"{prefix}without times"
    if seconds < UNIX_TIMES_FROM:
        return f"{prefix}hour {int(seconds // 3600)}"
    try:
        return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:00 UTC")
    except (OverflowError, ValueError, OSError):  # for instance nanoseconds
        return f"{prefix}without times in seconds"
