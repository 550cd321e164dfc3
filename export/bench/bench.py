"""Runs a bench: every method on the same scans, each timed alone."""

import platform
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property, lru_cache, partial
from hashlib import sha256
from pathlib import Path
from typing import Any

import numpy as np
from tqdm import tqdm

from derain.cards.card import DataCard, load_card
from derain.cards.rain_found import warn_without_rain
from derain.errors import counted
from derain.evaluation.scores import ScoredMethod, Scores, score
from derain.export.bench.bench_entries import BenchEntry, GivenMethod, bench_entries
from derain.export.bench.cost import Effort, measure_cost
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.bench.report import (
    draw_speed_error,
    failures_of,
    main_table,
    write_report,
)
from derain.export.bench.rows import Row, bench_rows
from derain.export.runtimes.session import DEFAULT_RUNTIME, FLOAT32_PRECISION, Runtime
from derain.export.timing import processor, versions
from derain.files import DEFAULT_COLUMNS
from derain.filters import FilterDerainer
from derain.filters.point_filter import filter_view, rain_among, rows_of
from derain.jobs.running import Submits, Task, ValueWork, values
from derain.scan import Bools, Scan
from derain.sources.folders import GivenScans, source_of
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.sources.spread import evenly_spaced
from derain.sources.training_record import training_overlap
from derain.sources.units import Division, FrameUnit, folder_of_paths, shared_options, units_of
from derain.spec import Spec
from derain.stores.url import Place
from derain.system.extras import MATPLOTLIB, MissingExtraError, require
from derain.system.notices import Notices, warn
from derain.views.scan_issues import ScanIssue


@dataclass(frozen=True)
class Bench:
    """The results of a bench; as text: its main table, and what failed.

    Attributes:
        rows: The results of each method, in the order of the methods.
        facts: Facts that the figures depend on besides the methods, as JSON-able primitives: scans,
            data card, seed, processor, versions.
    """

    rows: Sequence[Row]
    facts: Mapping[str, Any]

    def __str__(self) -> str:
        return "\n\n".join(filter(None, [main_table(self.rows), failures_of(self.rows)]))

    def __getitem__(self, title: str) -> Row:
        """The row of a method, by its title.

        Raises:
            KeyError: No method has this title.
        """
        return {row.title: row for row in self.rows}[title]

    def write(self, folder: str | Path) -> None:
        """Writes ``bench.md``, ``bench.csv``, ``bench.json`` and ``speed_error.png``.

        Without matplotlib there is no picture, but a warning.

        Args:
            folder: The folder, made if missing.

        Raises:
            InputError: A folder that cannot be written.
        """
        picture = Path(folder) / "speed_error.png"
        write_report(self.rows, self.facts, Path(folder))
        try:
            require(picture, MATPLOTLIB)
        except MissingExtraError as error:
            warn(str(error))
            picture.unlink(missing_ok=True)  # of an earlier bench, which is not this one
            return
        draw_speed_error(self.rows, self.facts, picture)


def bench(
    methods: str | Path | Sequence[GivenMethod] | Mapping[str, GivenMethod],
    scans: GivenScans,
    card: DataCard | str | Path,
    *,
    train: GivenScans | None = None,
    columns: Sequence[str] = DEFAULT_COLUMNS,
    intensity_scale: float = 1.0,
    rain_rates: Mapping[str, float] | None = None,
    threads: int = 0,
    timed: int = 10,
    repeats: int = 3,
    seed: int = 0,
    runtime: str = DEFAULT_RUNTIME,
    precision: str = FLOAT32_PRECISION,
) -> Bench:
    """Compares methods on the same labelled scans: error, time and memory.

    Each method is timed alone, in a process of its own. A function that is defined in the running
    script or session cannot be sent to one; it is timed in this process, and its row has no memory.

    Example:
        >>> import numpy as np
        >>> from derain.scan import Scan
        >>> points = np.random.default_rng(0).uniform(-9, 9, (500, 4))
        >>> scan = Scan.of(points).with_label(np.where(points[:, 3] < 0, 110, 40))
        >>> found = bench({"dim": lambda scan: scan.intensity < 0, "all": "all"}, [scan], "wads")
        >>> found["dim"].scores.pooled.iou, found["dim"].milliseconds > 0
        (1.0, True)

    Args:
        methods: Each an exported model (``.onnx``), parameters that ``derain tune`` wrote
            (``.yaml``), ``default``, the name of a filter or baseline (``position``,
            ``intensity``, ``all``, ``none``), a ``Derainer``, a filter, or any function from a Scan
            to which of its points are rain, bool (N,). A mapping gives them titles.
        scans: Labelled scans, in memory or in files and folders.
        card: What their labels mean: a data card, the name of a packaged one, or a YAML file.
        train: Labelled scans that ``position`` and ``intensity`` learn from.
        columns: Names of the columns of files that do not name them.
        intensity_scale: Factor from the scans' intensities to the unit of the methods, e.g. 255.
        rain_rates: Rain rate in mm/h by sequence, where it is known.
        threads: Threads of views and networks; 0 takes every core this process may use.
        timed: Scans that each method is timed on, spread evenly.
        repeats: Timed runs on each of them.
        seed: Random seed of the bootstrap intervals.
        runtime: Another runtime for every model besides onnxruntime, such as ``openvino``.
        precision: Of that runtime: ``float32``, or ``bf16`` where it and the processor have it.

    Returns:
        A row for each method, which can be printed and written.

    Raises:
        InputError: A method that is not known or cannot be read, or two of one title; no scans, or
            one that cannot be read or has no labels; nothing to time. The row of a method that
            fails states so.
    """
    effort = Effort(threads, timed, repeats, seed)
    card = card if isinstance(card, DataCard) else load_card(card)
    reader = FrameReader(card, intensity_scale, distinct=card.deduplicate)

    def labelled(given: GivenScans) -> LabelledFrames:
        return LabelledFrames(reader, source_of(given, columns), rain_rates or {})

    learn_from = None if train is None else labelled(train).truths
    rows = bench_entries(methods, learn_from, Runtime(runtime, precision))
    titles = ", ".join(repr(row.title) for row in rows)
    return run_bench(rows, labelled(scans), effort, command=f"derain.bench([{titles}], ...)")


def count_in_units(
    methods: Sequence[BenchEntry],
    data: LabelledFrames,
    threads: int,
    folder: Place | None = None,
    division: Division = Division(),
    executor: Submits | None = None,
) -> list[dict[str, Any]] | None:
    """Counts the answers of every method to every scan, unit by unit.

    Args:
        methods: The methods, one or more.
        data: The scans.
        threads: Threads of views and networks of a process; 0 takes every core it may use.
        folder: Folder of records, if the division keeps them; None keeps none.
        division: Division of the scans into units.
        executor: Does the units; None does them in this process.

    Returns:
        The counts of each unit, for :func:`run_bench`; None while other shards are to be done.

    Raises:
        InputError: A scan that cannot be read; records of other options in the folder.
    """
    work = Counting(methods, threads, data.reader, data.rain_rates)
    if folder is None or not division.keeps_records(data.frames, folder):
        # In this process they are of one scan, so that a progress bar counts scans.
        units = units_of(data.frames, None, 1 if executor is None else division.block)
        return values(Task(None, work), units, units, executor, "scoring")
    units = units_of(data.frames, None, division.block)
    job, shard = division.begin(folder, _options(methods, data, division.block), units)
    task = Task(job, work, folder_of_paths(data.frames, folder))
    return values(task, units, shard, executor, "scoring")


def run_bench(
    methods: Sequence[BenchEntry],
    data: LabelledFrames,
    effort: Effort,
    command: str,
    counted: Sequence[Mapping[str, Any]] | None = None,
) -> Bench:
    """Scores every method on every scan, and measures what each costs alone.

    Args:
        methods: The methods, one or more.
        data: The scans.
        effort: Amount of timing, and the seed.
        command: The command or call of this bench, for its report.
        counted: A result of :func:`count_in_units`; None counts now, in this process.

    Raises:
        InputError: A scan that cannot be read. The row of a method that fails states so.
    """
    if counted is None:
        counted = count_in_units(methods, data, effort.threads)
    assert counted is not None  # there is one shard
    notices = Notices()
    notes = [note for method in methods if (note := _overlap(method, data))]
    for note in notes:
        warn(note)
    timed_on: Sequence[Frame] = evenly_spaced(data.frames, effort.timed)
    timed_on = [frame.with_intensity_times(data.reader.intensity_scale) for frame in timed_on]
    scores = [Scores(data.reader.card) for _ in methods]
    for of_unit in counted:
        for of_method, counts in zip(scores, of_unit["counts"], strict=True):
            of_method.add_json(counts)
        for scan, method, kind, detail in of_unit["issues"]:
            notices.warn(scan, [ScanIssue(kind, detail)], method)
    rained = any(one.pooled.true_positive + one.pooled.false_negative for one in scores)
    warn_without_rain(rained, data.reader.card)
    costs = [
        measure_cost(method, timed_on, effort)
        for method in tqdm(methods, desc="timing", unit="method", disable=None)
    ]
    notices.warn_of_repeats()
    rows = bench_rows(methods, scores, costs, np.random.default_rng(effort.seed))
    files = [file for of_unit in counted for file in of_unit["files"]]
    facts = _facts(command, data, timed_on, effort, methods, files)
    return Bench(rows, {**facts, "notes": notes})


def scored_methods(bench_entries: Sequence[BenchEntry], threads: int) -> list[ScoredMethod]:
    """The methods, ready to judge one scan after the other; filters share their search.

    Args:
        bench_entries: The methods.
        threads: Threads of views and networks; 0 takes every core this process may use.
    """
    most = max((row.filter.filter.neighbours for row in bench_entries if row.filter), default=0)
    seen_by_filters = lru_cache(maxsize=1)(filter_view(most, threads))

    def filtered(derainer: FilterDerainer, scan: Scan) -> Bools:
        seen = seen_by_filters(scan)
        rain = rain_among(derainer.filter, seen, scan, derainer.candidates)
        return rows_of(rain, seen.inverse)

    return [
        partial(filtered, row.filter) if row.filter else row.ready(threads) for row in bench_entries
    ]


def _overlap(method: BenchEntry, data: LabelledFrames) -> str | None:
    """A note where a model was trained on the scans that it is measured on."""
    spec = method.spec_or_filter
    if not isinstance(spec, Spec):
        return None
    return training_overlap(method.title, spec, data.reader.card, data.frames)


@dataclass(frozen=True)
class Counting(ValueWork[FrameUnit]):
    """Counts the answers of methods to the scans of units.

    Attributes:
        methods: The methods.
        threads: Threads of views and networks.
        reader: Reads the scans.
        rain_rates: Rain rate in mm/h by sequence, where it is known.
    """

    methods: Sequence[BenchEntry]
    threads: int
    reader: FrameReader
    rain_rates: Mapping[str, float]

    def value(self, unit: FrameUnit) -> dict[str, Any]:
        """The counts of each method, where scans do not suit one, and fingerprints of the scans.

        Raises:
            InputError: A scan that cannot be read.
        """
        issues: list[tuple[str, str, str, str]] = []

        def scans() -> Iterator[Scan]:
            for frame in unit.frames:
                scan = self.reader.read(frame)
                issues.extend(self._issues(frame.name, scan))
                yield scan

        rates = [self.rain_rates.get(frame.sequence) for frame in unit.frames]
        scored = score(self._ready, scans(), self.reader.card, self.reader.distinct, rates)
        files = [{"scan": frame.name, "fingerprint": frame.fingerprint()} for frame in unit.frames]
        counts = [scores.to_json() for scores in scored]
        return {"counts": counts, "issues": issues, "files": files}

    def _issues(self, name: str, scan: Scan) -> Iterator[tuple[str, str, str, str]]:
        """Name of a scan, title of a method that it does not suit, and kind and detail of why."""
        for method in self.methods:
            if method.spec_or_filter is not None:
                for issue in method.spec_or_filter.issues(scan):
                    yield name, method.title, issue.kind, issue.detail

    @cached_property
    def _ready(self) -> list[ScoredMethod]:
        """The methods, which one process makes once."""
        return scored_methods(self.methods, self.threads)


def _options(methods: Sequence[BenchEntry], data: LabelledFrames, block: int) -> dict[str, Any]:
    """The options that the counts depend on besides the scans."""
    return {
        **shared_options("bench", data.frames, block),
        **{f"method {method.title}": method.fingerprint for method in methods},
        "card": data.reader.card.name,
        "content of the card": _fingerprint(data.reader.card),
        "intensity_scale": data.reader.intensity_scale,
        "distinct": data.reader.distinct,
        "rain rates": _fingerprint(sorted(data.rain_rates.items())),
    }


def _fingerprint(content: object) -> str:
    return sha256(repr(content).encode()).hexdigest()[:16]


def _facts(
    command: str,
    data: LabelledFrames,
    timed_on: Sequence[Frame],
    effort: Effort,
    methods: Sequence[BenchEntry],
    files: Sequence[Mapping[str, Any]],
) -> dict[str, Any]:
    """Everything that a bench depends on besides its methods, as JSON-able primitives."""
    card, frames = data.reader.card, data.frames
    return {
        "title": f"{card.title}, {counted(len(frames), 'scan')}",
        "command": command,
        "data": card.name,
        "simulated": card.simulated,
        "licence": card.licence,
        "rain": [card.classes[id_] for id_ in card.rain],
        "seed": effort.seed,
        "threads": effort.threads,
        "repeats": effort.repeats,
        "timed_on": [frame.name for frame in timed_on],
        "processor": processor(),
        "system": platform.platform(),
        "versions": versions([DEFAULT_RUNTIME, *(method.runtime.name for method in methods)]),
        "files": files,
    }
