"""Cleans the scans of a source, and reports what was done."""

from collections.abc import Sequence
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from derain.errors import InputError, printable
from derain.sources.clean_sink import CleanSink
from derain.sources.folders import GivenScans, source_of
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import Failures, judgements
from derain.sources.method import Method
from derain.sources.weather_monitor import WeatherMonitor, WeatherOptions
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import (
    HEAVIEST_RAIN,
    MOST_RAIN,
    ScanIssue,
    left_out,
    much_removed,
    no_points,
)
from derain.weather.record import WeatherRecord


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
    weather: WeatherRecord | None

    def __str__(self) -> str:
        name, total = printable(self.scan), sum(self.milliseconds.values())
        unsure = "" if self.not_known is None else f", {self.share_not_known:.1%} not known"
        weather = "" if self.weather is None else f", {self.weather}"
        return (
            f"{name}: {_counts(self.points, self.valid, self.rain)}{unsure}{weather}, "
            f"{total:.0f} ms"
        )

    @property
    def share_not_known(self) -> float:
        """Share of ``not_known`` in ``valid``."""
        return (self.not_known or 0) / max(self.valid, 1)


@dataclass(frozen=True)
class CleanReport:
    """What was done to the scans of a source, as :func:`clean` returns it.

    Example:
        >>> report = derain.clean("scan.bin", derain.FilterDerainer(derain.DROR()), "cleaned")
        >>> sum(scan.rain for scan in report.scans), str(report.weather.total.visibility)
        (20, 'not known')

    Attributes:
        scans: The cleaned scans, in order.
        failures: Why other scans were not cleaned.
        weather: The weather of all scans together.
    """

    scans: list[CleanedScan]
    failures: list[InputError]
    weather: WeatherMonitor

    def __str__(self) -> str:
        points, valid, rain = (
            sum(getattr(scan, name) for scan in self.scans) for name in ("points", "valid", "rain")
        )
        odd = sum(bool(scan.warnings) for scan in self.scans)
        return (
            f"{len(self.scans):,} scans: {_counts(points, valid, rain)}, {self.weather}; "
            f"{odd:,} scans with warnings"
        )


class CleaningObserver:
    """Follows a cleaning while it runs. A subclass prints or records; this one does nothing."""

    def judged(self, judgement: Judgement, odd: list[ScanIssue]) -> None:
        """Called for each judged scan, before it is written, with what is odd about it."""

    def cleaned(self, judgement: Judgement, scan: CleanedScan) -> None:
        """Called for each scan that is written."""

    def failed(self, error: InputError) -> None:
        """Called for each scan that could not be cleaned."""


def clean(
    source: GivenScans,
    method: Method,
    sink: CleanSink | Path | str,
    *,
    most_removed: float = MOST_RAIN,
    weather: WeatherOptions = WeatherOptions(),
    observer: CleaningObserver = CleaningObserver(),
) -> CleanReport:
    """Writes scans without their rain, and their labels (1 = rain).

    A scan that cannot be read, judged or written does not stop the others.

    Example:
        >>> report = derain.clean("scan.bin", derain.FilterDerainer(derain.DROR()), "cleaned")
        >>> report.scans[0].points, report.scans[0].rain, report.failures
        (820, 20, [])

    Args:
        source: A source; or one or more scans, frames, files and folders, in time order.
        method: A model, a filter, or a method that sees several scans.
        sink: Folder to write to, or a sink with its options, opened by ``with``.
        most_removed: Scans with a greater share of rain in their valid points are not written.
        weather: How the weather is measured.
        observer: Follows the cleaning.

    Returns:
        What was done to each scan, and to all of them.

    Raises:
        InputError: No scans, a folder whose files would be overwritten, or a bag that cannot be
            written.
    """
    source = source_of(source)
    monitor, failures = WeatherMonitor(weather, source), Failures(observer.failed)
    scans: list[CleanedScan] = []
    with nullcontext(sink) if isinstance(sink, CleanSink) else CleanSink(sink, source) as opened:
        frames = tqdm(source, unit="scan", disable=None)
        for frame, judgement, stopwatch in judgements(method, frames, failures.skipping_failures):
            with failures.skipping_failures(frame):
                odd = _issues(method, judgement, most_removed)
                observer.judged(judgement, odd)
                _refuse_too_much_rain(frame, judgement.share_of_rain, most_removed)
                with stopwatch.stage("weather"):
                    measured = judgement.weather if monitor.is_due(frame) else None
                with stopwatch.stage("write"):
                    opened.write(judgement)
                record = None if measured is None else monitor.add(frame, measured)
                cleaned = _cleaned(frame, judgement, stopwatch, odd, record)
                observer.cleaned(judgement, cleaned)
                scans.append(cleaned)
    return CleanReport(scans, failures.errors, monitor)


def _issues(method: Method, judgement: Judgement, most_removed: float) -> list[ScanIssue]:
    scan, share = judgement.scan, judgement.share_of_rain
    odd = [*method.issues(judgement), *left_out(scan), *no_points(scan)]
    return odd if share > most_removed else [*odd, *much_removed(share)]


def _refuse_too_much_rain(frame: Frame, share: float, most_removed: float) -> None:
    if share > most_removed:
        raise InputError(
            frame.name,
            f"left whole, for {share:.1%} of its valid points are called rain, where the "
            f"heaviest rain has {HEAVIEST_RAIN:.0%}",
            "See whether the method suits sensor and unit of intensity, or raise --most-removed.",
        )


def _cleaned(
    frame: Frame,
    judgement: Judgement,
    stopwatch: Stopwatch,
    odd: Sequence[ScanIssue],
    weather: WeatherRecord | None,
) -> CleanedScan:
    valid, known = judgement.scan.valid, judgement.known
    return CleanedScan(
        scan=frame.name,
        points=len(valid),
        valid=int(valid.sum()),
        rain=int(judgement.rain.sum()),
        share_removed=judgement.share_of_rain,
        not_known=None if known is None else int((valid & ~judgement.answered).sum()),
        milliseconds=dict(stopwatch.milliseconds),
        warnings=[issue.detail for issue in odd],
        weather=weather,
    )


def _counts(points: int, valid: int, rain: int) -> str:
    """The number of points, of those that can be judged, and of those that are rain."""
    return (
        f"{points:,} points, {valid:,} valid, {rain:,} of rain ({rain / max(valid, 1):.1%} of the "
        "valid)"
    )
