"""Cleans the scans of one unit: judges them, measures their weather, and writes them."""

from collections.abc import Callable, Collection, Iterator
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any

from derain.errors import InputError
from derain.files.reading import reading
from derain.sources.clean_sink import CleanSink, Destination
from derain.sources.cleaned_scan import CleanedScan, ScanOutcome, packed
from derain.sources.fetched_unit import fetched
from derain.sources.frame import Frame, time_of
from derain.sources.judgement import Judgement
from derain.sources.method import Method
from derain.sources.source import Frames
from derain.sources.spread import evenly_spaced
from derain.sources.stored_frame import StoredBag
from derain.sources.unit_judging import UnitJudging
from derain.sources.units import FrameUnit
from derain.sources.weather_monitor import SAMPLED_SCANS
from derain.system.stopwatch import Stopwatch
from derain.views.scan_issues import (
    HEAVIEST_RAIN,
    ScanIssue,
    left_out,
    much_removed,
    no_points,
)

# Receives the judgement of each scan before it is written.
OnJudgement = Callable[[Judgement], None]


@dataclass(frozen=True)
class UnitCleaning(UnitJudging[ScanOutcome]):
    """Cleans the scans of one unit after the other.

    Attributes:
        destination: Where they are written, and what is written of them.
        most_removed: Scans with a greater share of rain in their valid points are not written.
        measured: Keys of the scans whose weather is measured; None measures all.
    """

    destination: Destination
    most_removed: float
    measured: Collection[str] | None

    def do(self, unit: FrameUnit) -> Iterator[ScanOutcome]:
        """Cleans the scans of a unit."""
        held: list[ScanOutcome] = []
        with (
            fetched(unit) as (here, with_urls),
            self.destination.opened(Frames(here.frames)) as sink,
        ):
            for outcome in self._measuring(unit, here).clean(here, sink):
                if outcome.error is not None:
                    outcome = replace(outcome, error=with_urls(outcome.error))
                if self.destination.is_stored:  # what is not uploaded yet is not done
                    held.append(outcome)
                else:
                    yield outcome
        yield from held

    def clean(
        self, unit: FrameUnit, sink: CleanSink, on_judgement: OnJudgement = lambda judgement: None
    ) -> Iterator[ScanOutcome]:
        """Cleans the scans of a unit and writes them to an open sink.

        Args:
            unit: The unit.
            sink: Where they are written.
            on_judgement: Receives each judgement.

        Yields:
            What became of each scan.
        """
        for frame, answer in self.judged(unit):
            if isinstance(answer, InputError):
                yield ScanOutcome(frame, [], error=answer)
                continue
            _, judgement, stopwatch = answer
            on_judgement(judgement)
            try:
                with reading(Path(frame.name)):  # which names the file where the memory is full
                    outcome = self._cleaned(frame, judgement, stopwatch, sink)
            except InputError as error:
                outcome = ScanOutcome(frame, [], error=error)
            yield outcome

    def is_there(self, unit: FrameUnit) -> bool:
        """Whether all files and bags of the unit are there."""
        return self.destination.holds(Frames(unit.frames))

    def failed(self, unit: FrameUnit, error: InputError) -> Iterator[ScanOutcome]:
        """The outcome of a unit that failed as a whole, which is that of its first scan."""
        yield ScanOutcome(unit.frames[0], [], error=error)

    def error_of(self, outcome: ScanOutcome) -> InputError | None:
        """Why a scan was not cleaned."""
        return outcome.error

    def to_json(self, outcome: ScanOutcome) -> dict[str, Any]:
        """The outcome of a cleaned scan as a record has it."""
        return outcome.as_dict()

    def from_json(self, unit: FrameUnit, written: dict[str, Any]) -> ScanOutcome:
        """The outcome that a record has."""
        figures = dict(written)
        key, seconds, measured = (figures.pop(name) for name in ("key", "seconds", "measured"))
        cleaned = CleanedScan(**figures)
        return ScanOutcome(
            _frame(unit, key, cleaned.scan, seconds),
            [],
            cleaned,
            seconds,
            measured,
        )

    def _measuring(self, unit: FrameUnit, here: FrameUnit) -> "UnitCleaning":
        """The same where some clouds of a bag are measured, which are not known before now.

        Args:
            unit: The unit.
            here: The same with frames of this machine.
        """
        if self.measured is None or not isinstance(unit.frames[0], StoredBag):
            return self
        sample = evenly_spaced(here.frames, SAMPLED_SCANS)
        return replace(self, measured=frozenset(frame.key for frame in sample))

    def _cleaned(
        self, frame: Frame, judgement: Judgement, stopwatch: Stopwatch, sink: CleanSink
    ) -> ScanOutcome:
        issues = _issues(self.method, judgement, self.most_removed)
        share = judgement.share_of_rain
        if share > self.most_removed:
            error = InputError(
                frame.name,
                f"left whole, for {share:.1%} of its valid points are called rain, where the "
                f"heaviest rain has {HEAVIEST_RAIN:.0%}",
                "See whether the method suits sensor and unit of intensity, or raise "
                "--most-removed.",
            )
            return ScanOutcome(frame, issues, error=error)
        with stopwatch.stage("weather"):
            due = self.measured is None or frame.key in self.measured
            measured = packed(judgement.weather) if due else None
        with stopwatch.stage("write"):
            sink.write(judgement)
        valid, known = judgement.scan.valid, judgement.known
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


def _frame(unit: FrameUnit, key: str, name: str, seconds: float | None) -> Frame:
    """The frame of a unit that has a key, or the cloud of its bag."""
    first = unit.frames[0]
    if isinstance(first, StoredBag):
        return first.cloud(key, name, seconds)
    return unit.by_key[key]


def _issues(method: Method, judgement: Judgement, most_removed: float) -> list[ScanIssue]:
    scan, share = judgement.scan, judgement.share_of_rain
    odd = [*method.issues(judgement), *left_out(scan), *no_points(scan)]
    return odd if share > most_removed else [*odd, *much_removed(share)]
