"""Measures the columns of a table across sensors."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import asdict, dataclass, field
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from benchmarks.sensor_table.columns import Cell, Column
from benchmarks.sensor_table.inputs import DataFinder, LeftOut, file_sizes, require, rows_of
from benchmarks.sensor_table.plan import LabelledData, Plan
from derain.errors import reason_of
from derain.evaluation.counts import ratio
from derain.evaluation.scores import Scores, score
from derain.export.bench.bench import scored_methods
from derain.export.bench.bench_entries import BenchEntry, bench_entries
from derain.export.bench.cost import Effort, measure_cost
from derain.export.bench.labelled_frames import LabelledFrames
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.training_record import training_overlap
from derain.spec import Spec
from derain.views.full_scale import full_scale
from derain.views.scan_issues import SCALE_OF_UNIT

# Titles of the columns of what methods cost.
TIME, SIZE = "time", "file"

# Title of the column of the clean scan of which a method takes most.
MOST = "worst of the clean scans"


@dataclass
class Measurement:
    """Measures the entries of a plan, and notes those that cannot be measured.

    Attributes:
        plan: The rows and columns.
        shared: Folder that scans and weights are found below.
        work: Folder that what is simulated and exported goes to, and is found in again.
        threads: Threads of views and networks; 0 takes every core this process may use.
        repeats: Timed runs of each method; 0 times none.
        left_out: What is not in the table, and why.
        rows: The methods that were measured, by title.
    """

    plan: Plan
    shared: Path
    work: Path
    threads: int = 0
    repeats: int = 0
    left_out: LeftOut = field(default_factory=LeftOut)
    rows: dict[str, BenchEntry] = field(default_factory=dict)

    def columns(self) -> Iterator[Column]:
        """Every column that can be measured; labels measure alone."""
        rows = rows_of(self.plan.methods, self.shared, self.work / "published", self.left_out)
        self.rows |= {row.title: row for row in rows}
        finder = DataFinder(self.shared, self.work / "simulated")
        for title, data in self.plan.labelled.items():
            found = self.left_out.unless_found(title, partial(finder.measured, data))
            if found is not None:
                positions = list(self._positions(title, data, finder))
                self.rows |= {row.title: row for row in positions}
                of_data = [*rows, *positions]
                yield from self._of_labelled(title, data, found, of_data)
                if self.repeats and title == self.plan.timed:
                    yield self._times(found, of_data)
        clean = [column for folder in self.plan.clean for column in self._of_clean(folder, rows)]
        yield from clean
        if clean:
            yield _most_of(clean)
        yield Column(SIZE, "kB", {title: Cell(size / 1e3) for title, size in file_sizes(rows)})

    def _positions(
        self, title: str, data: LabelledData, finder: DataFinder
    ) -> Iterator[BenchEntry]:
        """The baseline of places alone, fitted to other scans of the same data."""
        for method, row in self.plan.methods.items():
            if row.is_position and not data.taken:
                find = partial(finder.of_places, data)
                others = self.left_out.unless_found(f"{method}: {title}", find)
                if others is not None:
                    yield from bench_entries({method: "position"}, others.truths)

    def _of_labelled(
        self, title: str, data: LabelledData, found: LabelledFrames, rows: Sequence[BenchEntry]
    ) -> Iterator[Column]:
        scans = map(found.reader.read, tqdm(found.frames, desc=title, unit="scan", disable=None))
        card = found.reader.card
        of_rows = score(scored_methods(rows, self.threads), scans, card, found.reader.distinct)
        scores = {row.title: each for row, each in zip(rows, of_rows, strict=True)}
        for method, each in scores.items():
            for scan, reason in each.failures.items():
                self.left_out.reasons[f"{method}: {scan}"] = reason
        about = {**asdict(data), "card": card.name, "measured_scans": len(found.frames)}
        if data.taken:
            yield from (_taken(title, kind, scores, about) for kind in data.taken)
            return
        learnt = {row.title for row in rows if self._learnt(row, title, found)}
        cells = {
            method: Cell(each.pooled.iou, method in learnt, asdict(each.pooled))
            for method, each in scores.items()
        }
        yield Column(title, "IoU", cells, about)

    def _learnt(self, row: BenchEntry, column: str, found: LabelledFrames) -> bool:
        """True if a method was trained on scans of a column, by its record or by the plan."""
        spec = row.spec_or_filter
        recorded = isinstance(spec, Spec) and training_overlap(
            row.title, spec, found.reader.card, found.frames
        )
        return bool(recorded) or column in self.plan.methods[row.title].learnt_from

    def _of_clean(self, folder: str, rows: Sequence[BenchEntry]) -> Iterator[Column]:
        frames = self.left_out.unless_found(
            folder, lambda: named_frames([require(self.shared / folder)])
        )
        for frame in tqdm(frames or (), desc=folder, unit="scan", disable=None):
            find = partial(self._of_clean_scan, frame, rows)
            if column := self.left_out.unless_found(frame.name, find):
                yield column

    def _of_clean_scan(self, frame: Frame, rows: Sequence[BenchEntry]) -> Column:
        """The share of a scan's points that each method calls rain, of those that can be judged."""
        scan, cells = frame.read(), {}
        points = int(scan.valid.sum())
        factors = [factor_for(row.spec_or_filter, scan) for row in rows]
        # One scan for each unit: filters share what they see of it.
        in_unit = {factor: scan.with_intensity_times(factor) for factor in factors}
        methods = scored_methods(rows, self.threads)
        for row, factor, method in zip(rows, factors, methods, strict=True):
            try:
                called = int(method(in_unit[factor]).sum())
            except Exception as error:  # whatever its libraries raise
                self.left_out.reasons[f"{row.title}: {frame.name}"] = reason_of(error)
            else:
                cells[row.title] = _share(called, points)
        return Column(Path(frame.name).stem, "%", cells, {"scan": Path(frame.name).name})

    def _times(self, found: LabelledFrames, rows: Sequence[BenchEntry]) -> Column:
        """Median milliseconds from the file to the mask, each method in a process of its own."""
        effort, cells = Effort(threads=self.threads, repeats=self.repeats), {}
        for row in tqdm(rows, desc="timing", unit="method", disable=None):
            cost = measure_cost(row, found.frames[:1], effort)
            if cost.failure is None:
                cells[row.title] = Cell(cost.times.percentile(50))
            else:
                self.left_out.reasons[f"{row.title}: {TIME}"] = cost.failure
        about = {"scan": found.frames[0].key, "threads": self.threads, "repeats": self.repeats}
        return Column(TIME, "ms", cells, about)


def _taken(title: str, kind: str, scores: Mapping[str, Scores], about: dict[str, Any]) -> Column:
    """The share that methods take of one class without rain, or of ``all`` of them."""
    cells = {}
    for method, each in scores.items():
        classes = [
            counted
            for name, counted in each.by_class.items()
            if kind in (name, "all") and not counted.rain
        ]
        if points := sum(counted.points for counted in classes):
            cells[method] = _share(sum(counted.called_rain for counted in classes), points)
    return Column(f"{title}: {kind}", "%", cells, about)


def _most_of(clean: Sequence[Column]) -> Column:
    """The largest share that each method takes of any of some scans."""
    methods = dict.fromkeys(method for column in clean for method in column.cells)
    shares = {
        method: max((c.cells[method] for c in clean if method in c.cells), key=lambda c: c.value)
        for method in methods
    }
    return Column(MOST, "%", shares)


def _share(called: int, points: int) -> Cell:
    counts = {"points": points, "called_rain": called}
    return Cell(float(ratio(called, points)), counts=counts)


def factor_for(spec_or_filter: object, scan: Scan) -> float:
    """The factor from a scan's intensities to the unit of a method; 1 if either has none.

    Args:
        spec_or_filter: What the method judges by: a filter, or the Spec of a model.
        scan: The scan.
    """
    unit = getattr(spec_or_filter, "intensity_unit", "")
    wanted = getattr(spec_or_filter, "FULL_SCALE", SCALE_OF_UNIT.get(unit))
    own = full_scale([scan])
    return wanted / own if wanted is not None and np.isfinite(own) else 1.0
