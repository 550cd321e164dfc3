"""``derain run``: cleans scans with an exported model or a filter."""

import argparse
import json
import sys
from collections.abc import Sequence
from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from derain.cli.arguments import share, threads
from derain.cli.filter_help import list_filters
from derain.cli.outputs import refuse_clashes
from derain.cli.scan_options import add_columns, add_intensity_scale
from derain.errors import InputError, printable
from derain.export.methods import load_method, named_method
from derain.export.runtime import Derainer
from derain.files import find_scans, read_scan, write_scan
from derain.files.labels import LABEL, write_labels
from derain.files.names import beside
from derain.files.reading import reading
from derain.filters import FilterDerainer, read_parameters
from derain.scan import Scan
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
  derain run dror scans/ --out cleaned
  derain run best.yaml scans/ --out cleaned
  derain run dsor scans/ --out cleaned --parameters best.yaml --set range_multiplier=0.08

METHOD is a model written by `derain export` (.onnx), parameters that `derain tune` wrote (.yaml),
or a filter (below).
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
    parser.add_argument("scans", nargs="+", type=Path, help="scans, or folders of scans")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--threads", type=threads, default=0, help="threads (default: all cores)")
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
    method = load_method(*_named_method(arguments), arguments.threads)
    scans = find_scans(arguments.scans)
    refuse_clashes(scans, arguments.out)
    notices = Notices()
    done: list[Cleaned] = []
    for path in tqdm(scans, unit="scan", disable=None):
        try:
            with reading(path):  # which knows what to say where the memory is full
                cleaned = _clean(path, method, arguments, notices)
        except InputError as error:
            tqdm.write(f"derain: {error}", sys.stderr)
            continue
        done.append(cleaned)
        tqdm.write(json.dumps(asdict(cleaned)) if arguments.json else str(cleaned), sys.stdout)
    notices.tell_how_many_more()
    if len(done) > 1:
        print(_summary(done), file=sys.stderr if arguments.json else sys.stdout)
    if failed := len(scans) - len(done):
        print(f"derain: {failed} of {len(scans)} scans could not be cleaned", file=sys.stderr)
    return 2 if failed else 0


def _clean(
    path: Path, method: Derainer | FilterDerainer, arguments: argparse.Namespace, notices: Notices
) -> Cleaned:
    stopwatch = Stopwatch()
    with stopwatch.stage("read"):
        scan = read_scan(path, arguments.columns)
    rain, odd = _judge(scan.with_intensity_times(arguments.intensity_scale), method, stopwatch)
    valid, removed = int(scan.valid.sum()), int(rain.sum())
    share_removed = removed / max(valid, 1)
    odd += [*much_removed(share_removed), *left_out(scan)]
    notices.tell(str(path), odd)
    if share_removed > arguments.most_removed:
        raise InputError(
            path,
            f"{share_removed:.1%} of its points are called rain, and nothing was written",
            "See whether the method suits it, or raise --most-removed.",
        )
    with stopwatch.stage("write"):
        _write(arguments.out / path.name, scan, rain)
    return Cleaned(
        str(path),
        len(scan),
        valid,
        removed,
        share_removed,
        stopwatch.milliseconds,
        [oddity.detail for oddity in odd],
    )


def _judge(
    scan: Scan, method: Derainer | FilterDerainer, stopwatch: Stopwatch
) -> tuple[NDArray[np.bool_], list[Oddity]]:
    """Which points are rain, bool (N,), and what is odd about the scan for this method."""
    if isinstance(method, FilterDerainer):
        return method(scan, stopwatch), list(method.filter.oddities(scan))
    judgement = method.judge(scan, stopwatch)
    outside = outside_view(scan, judgement.judged, method.spec.data)
    return judgement.rain, [*method.spec.oddities(scan), *outside]


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


def _write(path: Path, scan: Scan, rain: NDArray[np.bool_]) -> None:
    """Writes the cleaned scan, then its labels: where there are labels, the scan is complete."""
    write_scan(path, scan.take(~rain))
    write_labels(beside(path, LABEL), rain)
