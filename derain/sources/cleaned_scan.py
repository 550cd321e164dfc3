"""What was done to a scan, in figures and as its record has it."""

import base64
import zlib
from dataclasses import asdict, dataclass, replace
from typing import Any, Self

import numpy as np

from derain.errors import InputError, printable
from derain.sources.frame import Frame
from derain.views.scan_issues import ScanIssue
from derain.weather.record import WeatherRecord
from derain.weather.scan_weather import ScanWeather


@dataclass(frozen=True)
class CleanedScan:
    """What was done to one scan.

    Attributes:
        scan: Its file.
        points: Number of points.
        valid: Number of points that can be judged.
        rain: Number of removed points.
        share_removed: Share of ``rain`` in ``valid``.
        not_known: Number of valid points of which the method is not sure; None for a method that
            does not report doubt.
        milliseconds: Time of each stage.
        warnings: What is odd about the scan.
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
    """What became of one scan of a source.

    Attributes:
        frame: The scan.
        issues: What is odd about it.
        cleaned: What was done to it; None where it could not be cleaned.
        seconds: When it was taken, seconds; None where that is not known.
        packed: The weather that it shows, as text; None where it was not measured.
        error: Why it could not be cleaned; None where it was.
    """

    frame: Frame
    issues: list[ScanIssue]
    cleaned: CleanedScan | None = None
    seconds: float | None = None
    packed: str | None = None
    error: InputError | None = None

    @property
    def figures(self) -> CleanedScan:
        """What was done to a scan that was cleaned."""
        assert self.cleaned is not None
        return self.cleaned

    @property
    def measured(self) -> ScanWeather | None:
        """The weather that it shows; None where it was not measured."""
        return None if self.packed is None else unpacked(self.packed)

    def with_weather(self, weather: WeatherRecord | None) -> Self:
        """The same, whose figures have those of the weather."""
        return replace(self, cleaned=replace(self.figures, weather=weather))

    def as_dict(self) -> dict[str, Any]:
        """The outcome of a cleaned scan as the record of its unit has it."""
        figures = asdict(self.figures)
        del figures["weather"]  # that of a recording depends on the scans before
        return {
            **figures,
            "key": self.frame.key,
            "seconds": self.seconds,
            "measured": self.packed,
        }


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
