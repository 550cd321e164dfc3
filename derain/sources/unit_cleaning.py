"""Cleans the scans of one unit: judges them, measures their weather, and writes them."""

from collections.abc import Collection, Iterator
from dataclasses import dataclass, replace
from functools import partial
from typing import Any

from derain.errors import InputError
from derain.jobs.running import IsThere
from derain.sources.clean_sink import CleanSink, Destination
from derain.sources.cleaned_scan import CleanedScan, ScanOutcome, packed
from derain.sources.frame import Frame, time_of
from derain.sources.judgement import Judgement
from derain.sources.source import Frames
from derain.sources.spread import evenly_spaced
from derain.sources.stored_frame import StoredBag
from derain.sources.unit_judging import UnitJudging
from derain.sources.units import FrameUnit
from derain.sources.weather_monitor import SAMPLED_SCANS, recording_numbers
from derain.stores.url import path_of
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import HEAVIEST_RAIN, left_out, much_removed, no_points


@dataclass(frozen=True)
class UnitCleaning(UnitJudging[ScanOutcome]):
    """Cleans the scans of one unit after the other.

    Attributes:
        destination: Folder and form of the written scans.
        most_removed: Scans with a greater share of rain in their valid points are not written.
        measured: Keys of the scans whose weather is measured; None measures all.
        finds_recordings: True if only the unit shows which of its scans follow one another.
    """

    destination: Destination
    most_removed: float
    measured: Collection[str] | None
    finds_recordings: bool = False

    def do(self, unit: FrameUnit) -> Iterator[ScanOutcome]:
        """Cleans the scans of a unit."""
        held: list[ScanOutcome] = []
        with (
            unit.fetched() as (here, with_urls),
            self.destination.opened(Frames(here.frames)) as (sink, uploaded),
        ):
            for outcome in self._with_cloud_counts(unit, here).clean(here, sink):
                if outcome.error is not None:
                    outcome = replace(outcome, error=with_urls(outcome.error))
                if self.destination.is_stored:  # a scan is done once it is uploaded
                    held.append(outcome)
                else:
                    yield outcome
        if held:
            held[-1] = replace(held[-1], uploaded=uploaded)
        yield from held

    def clean(self, unit: FrameUnit, sink: CleanSink) -> Iterator[ScanOutcome]:
        """Cleans the scans of a unit and writes them to an open sink.

        Args:
            unit: The unit.
            sink: The file or folder to write to.

        Yields:
            Outcomes of all scans; then, of a bag that could not be written, failures of all its
            clouds.
        """
        numbers = recording_numbers(unit.frames) if self.finds_recordings else {}
        for outcome in self.results(unit, partial(self._cleaned, sink=sink)):
            key = outcome.frame.key
            recording = f"{unit.id} {numbers[key]}" if key in numbers else None
            yield replace(outcome, recording=recording)
        for frame, error in sink.finish_bags(unit.frames):
            yield self.failure(frame, error)

    def look(self) -> IsThere[FrameUnit, ScanOutcome]:
        """Looks up the results written so far."""
        stamps = self.destination.stamps()

        def is_there(unit: FrameUnit, outcomes: list[ScanOutcome]) -> bool:
            uploaded = [item for outcome in outcomes for item in outcome.uploaded.items()]
            stored = all(stamps.get(path) == stamp for path, stamp in uploaded)
            return stored and self.destination.holds(Frames(unit.frames))

        return is_there

    def failure(self, frame: Frame, error: InputError) -> ScanOutcome:
        """The outcome of a scan that failed."""
        return ScanOutcome(frame, [], error=error)

    def from_json(self, unit: FrameUnit, written: dict[str, Any]) -> ScanOutcome:
        """The outcome that a record has."""
        first, key, seconds = unit.frames[0], written["key"], written["seconds"]
        cleaned = CleanedScan(**written["cleaned"])
        if isinstance(first, StoredBag):  # its clouds have a key, a name and a time alone
            frame: Frame = replace(first, key=key, path=path_of(cleaned.scan), time=seconds)
        else:
            frame = unit.by_key[key]
        return ScanOutcome(
            frame,
            [],
            cleaned,
            seconds,
            written["measured"],
            recording=written["recording"],
            uploaded=written["uploaded"],
        )

    def _with_cloud_counts(self, unit: FrameUnit, here: FrameUnit) -> "UnitCleaning":
        """The same, completed for a bag in a store, whose clouds are known only after fetching it.

        Args:
            unit: The unit.
            here: The unit with frames of this machine.
        """
        if not isinstance(unit.frames[0], StoredBag):
            return self
        if self.measured is None:
            return replace(self, finds_recordings=True)
        sample = evenly_spaced(here.frames, SAMPLED_SCANS)
        return replace(self, measured=frozenset(frame.key for frame in sample))

    def _cleaned(
        self, frame: Frame, judgement: Judgement, stopwatch: Stopwatch, sink: CleanSink
    ) -> ScanOutcome:
        scan, share = judgement.scan, judgement.share_of_rain
        issues = [*self.method.issues(judgement), *left_out(scan), *no_points(scan)]
        if share > self.most_removed:
            error = InputError(
                frame.name,
                f"left whole: {share:.1%} of its valid points are called rain, and the heaviest "
                f"rain has {HEAVIEST_RAIN:.0%}",
                "Check that the method suits the sensor and its unit of intensity, or raise "
                "--most-removed.",
            )
            return ScanOutcome(frame, issues, error=error)
        issues += much_removed(share)
        with stopwatch.stage("weather"):
            due = self.measured is None or frame.key in self.measured
            measured = packed(judgement.weather) if due else None
        with stopwatch.stage("write"):
            sink.write(judgement)
        valid, known = judgement.possible, judgement.known
        figures = CleanedScan(
            scan=frame.name,
            points=len(valid),
            valid=int(valid.sum()),
            rain=int(judgement.rain.sum()),
            share_removed=share,
            not_known=None if known is None else int((valid & ~judgement.answered).sum()),
            milliseconds=dict(stopwatch.milliseconds),
            warnings=[issue.detail for issue in issues],
        )
        return ScanOutcome(frame, issues, figures, time_of(frame), measured)
