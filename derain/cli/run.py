"""``derain run``: cleans scans with an exported model or a filter."""

import argparse
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from derain.cli.arguments import add_threads, share
from derain.cli.filter_help import list_filters
from derain.cli.outputs import folder_sink, tell
from derain.cli.runtime_options import add_runtime, runtime_of
from derain.cli.scan_by_scan import ScanByScan
from derain.cli.scan_options import add_columns, add_intensity_scale
from derain.errors import InputError, printable
from derain.export.methods import load_method, named_method
from derain.export.runtime import Derainer
from derain.filters import FilterDerainer, read_parameters
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.sink import Sink
from derain.system.memory import keep_freed_memory
from derain.system.notices import Notices
from derain.system.stopwatch import Stopwatch
from derain.views.oddities import Oddity, left_out, much_removed, outside_view

SUMMARY = "clean scans on a CPU, without torch"

DESCRIPTION = """\
Cleans scans: writes <stem>.label (1 = rain, one per row of the input) and the scan without its
rain, in the input's format with every field kept.

  derain run model.onnx scan.bin --out cleaned
  derain run model.onnx scans/ more/scan.pcd --out cleaned --threads 2 --json
  derain run model.onnx nuscenes/ --out cleaned --columns x,y,z,intensity,ring
  derain run model.onnx scans/ --out cleaned --runtime openvino --precision bf16
  derain run dror scans/ --out cleaned
  derain run dror WADS/ --out cleaned
  derain run best.yaml scans/ --out cleaned
  derain run dsor scans/ --out cleaned --parameters best.yaml --set range_multiplier=0.08

METHOD is a model written by `derain export` (.onnx), parameters that `derain tune` wrote (.yaml),
or a filter (below). Of a data set, results are named by their paths in it.
What is odd about a scan is warned of, each fault once. One of which more than --most-removed is
called rain is left alone. It and a scan that cannot be read are reported and passed over; the exit
code is then 2.
"""


@dataclass(frozen=True)
class Cleaned:
    """What was done to one scan.

    Attributes:
        scan: Its file.
        points: Its points.
        valid: Those of them that can be judged.
        rain: Those of them that were removed.
        share_removed: Share of ``rain`` in ``valid``.
        milliseconds: By stage.
        warnings: What is odd about it.
    """

    scan: str
    points: int
    valid: int
    rain: int
    share_removed: float
    milliseconds: dict[str, float]
    warnings: list[str]

    def __str__(self) -> str:
        name, total = printable(self.scan), sum(self.milliseconds.values())
        return (
            f"{name}: {self.points:,} points, {self.rain:,} of rain "
            f"({self.share_removed:.1%}), {total:.0f} ms"
        )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "method", metavar="METHOD", help="ONNX file, YAML file of parameters, or name of a filter"
    )
    list_filters(parser)
    parser.add_argument(
        "scans", nargs="+", type=Path, help="scans, folders of scans, or a data set's folder"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    add_threads(parser)
    add_runtime(parser, help="what runs the model")
    parser.add_argument("--json", action="store_true", help="print one JSON object a scan")
    add_columns(parser)
    add_intensity_scale(parser)
    parser.add_argument(
        "--most-removed",
        type=share,
        default=1.0,
        metavar="SHARE",
        help="leave a scan alone of which a greater share is called rain, e.g. 0.5 (default: 1)",
    )
    parser.add_argument(
        "--parameters", type=Path, metavar="YAML", help="the method's parameters, as tuned"
    )
    parser.add_argument(
        "--set",
        type=_assignment,
        action="append",
        default=[],
        metavar="NAME=VALUE",
        help="one parameter of the method, over those of --parameters; may be given again",
    )


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    keep_freed_memory()
    runtime = runtime_of(arguments)
    method = load_method(*_named_method(arguments), arguments.threads, runtime)
    source = named_frames(arguments.scans, arguments.columns)
    cleaning = _Cleaning(method, folder_sink(arguments.out, source), arguments)
    scans = ScanByScan(source)
    for frame in scans:
        if method.starts_anew(frame):
            cleaning.finish(scans)
        with scans.passing_over(frame):
            cleaning.clean(frame)
    cleaning.finish(scans)
    cleaning.notices.tell_how_many_more()
    if len(cleaning.done) > 1:
        print(_summary(cleaning.done), file=sys.stderr if arguments.json else sys.stdout)
    return scans.exit_code("{scans} could not be cleaned")


class _Cleaning:
    """What cleans frame after frame, and remembers what was done."""

    def __init__(
        self, method: Derainer | FilterDerainer, sink: Sink, arguments: argparse.Namespace
    ) -> None:
        self.method = method
        self.sink = sink
        self.arguments = arguments
        self.notices = Notices()
        self.done: list[Cleaned] = []

    def clean(self, frame: Frame) -> None:
        """Judges the next frame, and writes what is known by then: of this one, or an earlier."""
        stopwatch = Stopwatch()
        frame = frame.with_intensity_times(self.arguments.intensity_scale)
        judgement = self.method.push(frame, stopwatch)
        if judgement is not None:
            self._write(judgement, stopwatch)

    def finish(self, scans: ScanByScan) -> None:
        """Writes what still waits for scans after the last of a recording."""
        while self.method.waiting:  # where one fails, the others go on waiting
            with scans.passing_over(scans.source[-1]):
                stopwatch = Stopwatch()
                for judgement in self.method.flush(stopwatch):
                    self._write(judgement, stopwatch)
                    stopwatch.milliseconds.clear()

    def _write(self, judgement: Judgement, stopwatch: Stopwatch) -> None:
        scan, frame, rain = judgement.scan, judgement.frame, judgement.rain
        assert frame is not None  # it was pushed
        valid, removed = int(scan.valid.sum()), int(rain.sum())
        share_removed = removed / max(valid, 1)
        odd = [*_oddities(judgement, self.method), *much_removed(share_removed), *left_out(scan)]
        self.notices.tell(frame.name, odd)
        if share_removed > self.arguments.most_removed:
            raise InputError(
                frame.name,
                f"{share_removed:.1%} of its points are called rain, and nothing was written",
                "See whether the method suits it, or raise --most-removed.",
            )
        with stopwatch.stage("write"):
            self.sink.write(frame, scan.take(~rain), rain)
        told = [oddity.detail for oddity in odd]
        times = dict(stopwatch.milliseconds)
        cleaned = Cleaned(frame.name, len(scan), valid, removed, share_removed, times, told)
        self.done.append(cleaned)
        tell(cleaned, self.arguments.json)


def _oddities(judgement: Judgement, method: Derainer | FilterDerainer) -> Sequence[Oddity]:
    """What is odd about a scan for the method that judged it."""
    if isinstance(method, FilterDerainer):
        return list(method.filter.oddities(judgement.scan))
    outside = outside_view(judgement.scan, judgement.judged, method.spec.data)
    return [*method.spec.oddities(judgement.scan), *outside]


def _summary(done: Sequence[Cleaned]) -> str:
    """What was done to all scans together."""
    valid, removed = sum(item.valid for item in done), sum(item.rain for item in done)
    odd = sum(bool(item.warnings) for item in done)
    return (
        f"{len(done):,} scans: {sum(item.points for item in done):,} points, {removed:,} of rain "
        f"({removed / max(valid, 1):.1%}); {odd:,} scans with warnings"
    )


def _named_method(arguments: argparse.Namespace) -> tuple[str, dict[str, Any]]:
    """The method, and its parameters: those of the files, and over them those set one by one."""
    name, parameters = named_method(arguments.method)
    if arguments.parameters is not None:
        method, tuned = read_parameters(arguments.parameters)
        # Models are files, which have more than one name.
        if Path(method).resolve() != Path(name).resolve():
            raise InputError(
                arguments.parameters,
                f"holds parameters of {method}, not of {name}",
                f"Run {method} with it.",
            )
        parameters |= tuned
    return name, parameters | dict(arguments.set)


def _assignment(text: str) -> tuple[str, int | float | str]:
    """A parameter's name and value: a number where it reads as one."""
    name, equals, value = text.partition("=")
    if not (name and equals and value):
        raise argparse.ArgumentTypeError(f"{text} is not NAME=VALUE")
    for kind in (int, float):
        try:
            return name, kind(value)
        except ValueError:
            continue
    return name, value
