"""Cleans the scans of a source, and reports the results."""

from collections import defaultdict
from collections.abc import Callable
from contextlib import nullcontext
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from tqdm import tqdm

from derain.errors import InputError, counted
from derain.jobs.running import Submits, Task, run
from derain.sources.clean_sink import CleanSink
from derain.sources.cleaned_scan import CleanedScan, ScanOutcome, counts
from derain.sources.folders import GivenScans, source_of
from derain.sources.method import Method
from derain.sources.source import Source
from derain.sources.stored_frame import StoredFrame
from derain.sources.unit_cleaning import UnitCleaning
from derain.sources.units import Division, folder_of_paths, units_of, whole
from derain.sources.weather_monitor import WeatherMonitor, WeatherOptions
from derain.views.scan_issues import MOST_RAIN


@dataclass(frozen=True)
class CleanReport:
    """The results of :func:`clean` for the scans of a source.

    Example:
        >>> report = derain.clean("scan.bin", derain.FilterDerainer(derain.DROR()), "cleaned")
        >>> sum(scan.rain for scan in report.scans), str(report.weather.total.visibility)
        (20, '42.9 m [29.5 to 64.7 m]')

    Attributes:
        scans: The cleaned scans, in order.
        failures: Each reason why scans were not cleaned, once.
        weather: The weather of all scans that it is measured of: some, unless every one is asked
            for. Clouds of a bag that failed later are among them.
        before: Number of the cleaned scans that an earlier run had cleaned.
        not_cleaned: Number of scans that were not cleaned.
    """

    scans: list[CleanedScan]
    failures: list[InputError]
    weather: WeatherMonitor
    before: int
    not_cleaned: int

    def __str__(self) -> str:
        points, valid, rain = (
            sum(getattr(scan, name) for scan in self.scans) for name in ("points", "valid", "rain")
        )
        odd = sum(bool(scan.warnings) for scan in self.scans)
        before = f" ({self.before:,} of them done before)" if self.before else ""
        failed = f", {self.not_cleaned:,} not cleaned" if self.not_cleaned else ""
        return (
            f"{counted(len(self.scans), 'scan')}{before}{failed}: {counts(points, valid, rain)}, "
            f"{self.weather}; {counted(odd, 'scan')} with warnings"
        )


def clean(
    source: GivenScans,
    method: Method,
    sink: CleanSink | Path | str,
    *,
    most_removed: float = MOST_RAIN,
    weather: WeatherOptions = WeatherOptions(),
    watch: Callable[[ScanOutcome], None] = lambda outcome: None,
    division: Division | None = None,
    executor: Submits | None = None,
) -> CleanReport:
    """Writes scans without their rain, and their labels (1 = rain).

    A scan or a bag that cannot be read, judged or written does not stop the others.

    Example:
        >>> report = derain.clean("scan.bin", derain.FilterDerainer(derain.DROR()), "cleaned")
        >>> report.scans[0].points, report.scans[0].rain, report.failures
        (820, 20, [])

    Args:
        source: A source; or one or more scans, frames, files and folders, in time order.
        method: A model, a filter, or a method that sees several scans.
        sink: Folder or URL to write to, or a sink with its options, opened by ``with``.
        most_removed: Scans with a greater share of rain in their valid points are not written.
        weather: Options for measuring the weather.
        watch: Called for each scan that is written, though a bag may still fail at a later one; for
            each that could not be cleaned, and once for a whole bag.
        division: Division of the scans into units. Where there are more scans than a block has,
            the folder keeps a record of each unit, and a run resumes from them after a stop.
            None keeps no records, unless there is an executor, or a source or a sink in an object
            store.
        executor: Does the units: an executor of :mod:`concurrent.futures` or the like, whose
            processes find all files by the same paths. None does them in this process.

    Returns:
        The results of each scan, and of all together.

    Raises:
        InputError: No scans, or a folder whose files would be overwritten; records of other options
            in the folder; an executor that has ended.
    """
    if not hasattr(method, "push"):
        remedy = "Give derain.Derainer(...) or derain.FilterDerainer(...)."
        raise InputError("method", f"{type(method).__name__} is no method", remedy)
    source = source_of(source, results=[] if isinstance(sink, CleanSink) else [sink])
    monitor = WeatherMonitor(weather, source)
    cleaned: dict[str, CleanedScan] = {}  # by key
    failures: dict[str, InputError] = {}  # by text: that of a bag is the same for all its clouds
    before = 0
    with nullcontext(sink) if isinstance(sink, CleanSink) else CleanSink(sink, source) as opened:
        work = UnitCleaning(method, "", opened.destination, most_removed, monitor.sample)
        is_read_from_store = any(isinstance(frame, StoredFrame) for frame in source)
        if executor is not None or is_read_from_store or opened.destination.is_stored:
            division = replace(division or Division(), keep_records=True)
        if division is not None and division.keeps_records(source, opened.destination.folder):
            work = replace(work, fingerprint=method.fingerprint())
            job, units = division.begin(
                opened.destination.folder,
                _options(source, work, opened, division),
                units_of(source, method, division.block),
            )
            written_to = () if opened.destination.is_stored else (opened.folder,)
            task = Task(job, work, folder_of_paths(source, *written_to))
            outcomes = run(task, units, executor)
        else:
            units = [whole(source)]
            cleaning = work.clean(units[0], opened)
            outcomes = ((units[0], outcome, False) for outcome in cleaning)
        scans = sum(len(unit.frames) for unit in units)
        found: dict[str, set[str]] = defaultdict(set)
        for of_unit, outcome, was_there in tqdm(outcomes, total=scans, unit="scan", disable=None):
            key = outcome.frame.key
            found[of_unit.id].add(key)
            if outcome.error is not None:
                cleaned.pop(key, None)  # of a bag that failed at a later cloud
                if str(outcome.error) not in failures:
                    failures[str(outcome.error)] = outcome.error
                    watch(outcome)
                continue
            if (measured := outcome.measured) is not None:
                record = monitor.add(outcome.frame, measured, outcome.recording)
                outcome = replace(outcome, cleaned=replace(outcome.figures, weather=record))
            before += was_there
            cleaned[key] = outcome.figures
            watch(replace(outcome, was_there=was_there))
    # How many clouds the bags of a store have shows only when they are fetched.
    scans = sum(max(len(unit.frames), len(found[unit.id])) for unit in units)
    not_cleaned = scans - len(cleaned)
    return CleanReport([*cleaned.values()], [*failures.values()], monitor, before, not_cleaned)


def _options(
    source: Source, work: UnitCleaning, sink: CleanSink, division: Division
) -> dict[str, Any]:
    """All that the results depend on but the scans."""
    return {
        **work.options("run", source, division.block),
        **sink.options,
        "most_removed": work.most_removed,
        "weather (--weather, --json, --fail-at, --dry)": (
            "of every scan" if work.measured is None else "of some scans"
        ),
    }
