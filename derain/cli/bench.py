"""``derain bench``: methods side by side, speed against error."""

import argparse
from collections.abc import Mapping, Sequence
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING

from derain.cli.arguments import add_threads, command_line, count
from derain.cli.labelled_data import add_data_arguments, labelled
from derain.cli.method_options import add_runtime, list_filters, runtime_of
from derain.cli.outputs import print_lines
from derain.errors import InputError
from derain.evaluation.published_tables import TABLES, paper_table, scans_by_group
from derain.files.atomic import replacing, require_writable

if TYPE_CHECKING:
    from derain.datamodules.scan_data import Part, ScanData
    from derain.export.bench.bench import Bench
    from derain.export.bench.bench_entries import LearnFrom
    from derain.export.bench.labelled_frames import LabelledFrames
    from derain.sources.frame import Frame
    from derain.sources.source import Frames

DESCRIPTION = """\
Runs every method on the same labelled scans, and writes a table (bench.md, bench.csv, bench.json)
and a plot of error against time (speed_error.png).

  derain bench --data scans/ --card wads --methods default outdet.onnx dror dsor all none \\
      --out bench
  derain bench --data DATASET --methods outdet.onnx int8=outdet_int8.onnx tuned=dsor.yaml \\
      position intensity all none --out bench
  derain bench --data scans/ --card wads --methods outdet.onnx --runtime openvino \\
      --precision bf16 --out bench
  derain bench --data test/ --train train/ --card wads --methods position intensity --out bench
  derain bench --paper table2 --data REHEARSE3D_PUBLIC --methods outdet.onnx salsanext.onnx \\
      lisnownet.onnx dsor.yaml dror.yaml position all none --out table2
  derain bench --paper table3 --data REHEARSE3D_PUBLIC --rain-rates rates.yaml \\
      --methods outdet.onnx dsor.yaml position all none --out table3

A method is a model (.onnx), parameters from `derain tune` (.yaml), default or a filter (below), or
a baseline: position and intensity, learnt from the training scans, all and none.
With --runtime, each model has a second row for that runtime, and derain prints how it differs from
onnxruntime.
Scoring runs all methods in one process, where filters share one neighbour search. Each method is
then timed alone, in its own process.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    add_data_arguments(parser, part="test")
    list_filters(parser)
    parser.add_argument("--methods", nargs="+", required=True, metavar="[TITLE=]METHOD")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--train",
        type=Path,
        nargs="+",
        help="labelled scans for the baselines position and intensity "
        "(default: the training part of a data set)",
    )
    parser.add_argument("--limit", type=count, help="number of scans, evenly spread (default: all)")
    parser.add_argument(
        "--distinct",
        action=argparse.BooleanOptionalAction,
        help="count points at the same position once, as published results on WADS do "
        "(default: from the data card)",
    )
    parser.add_argument(
        "--rain-rates",
        type=Path,
        metavar="YAML",
        help='rain rate of each sequence in mm/h, as "005": 25 (default: those of the simulation)',
    )
    parser.add_argument("--paper", choices=TABLES, help="also print this published table")
    add_threads(parser)
    add_runtime(parser, help="second runtime for the models")
    parser.add_argument(
        "--timed", type=count, default=10, help="number of timed scans (default: %(default)s)"
    )
    parser.add_argument(
        "--repeats", type=count, default=3, help="timed runs of each scan (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="random seed (default: 0)")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.datamodules.labelled import rain_rates
    from derain.datamodules.scan_data import SequenceData
    from derain.export.bench.bench import Effort, run_bench
    from derain.export.bench.bench_entries import bench_entries
    from derain.export.bench.report import with_published_rows
    from derain.sources.spread import evenly_spaced

    read = partial(
        labelled,
        card=arguments.card,
        columns=arguments.columns,
        intensity_scale=arguments.intensity_scale,
        topic=arguments.topic,
        distinct=arguments.distinct,
    )
    data = read(arguments.data)
    rates = rain_rates(arguments.data, arguments.rain_rates)
    methods = bench_entries(
        arguments.methods,
        _learn_from(data, None if arguments.train is None else read(arguments.train)),
        runtime_of(arguments.runtime, arguments.precision),
    )
    require_writable(arguments.out / "bench.json")

    def bench(frames: Sequence["Frame"], out: Path) -> "Bench":
        """Benches the methods on some of the scans, and writes tables and picture."""
        scans = _labelled_frames(data, frames, rates)
        chosen = evenly_spaced(frames, arguments.limit or len(frames))
        effort = Effort(arguments.threads, arguments.timed, arguments.repeats, arguments.seed)
        bench = run_bench(methods, replace(scans, frames=chosen), effort, command_line(arguments))
        bench.write(out)
        return bench

    if arguments.paper is None:
        print_lines(str(bench(_frames(data, arguments.part), arguments.out)))
        return 0
    if not isinstance(data, SequenceData):
        raise InputError(
            arguments.data[0], "has no split, which the paper's tables ask for", "Name the root."
        )
    table = paper_table(arguments.paper)
    groups = scans_by_group(table, partial(_frames, data), lambda frame: rates.get(frame.sequence))
    ours = {group: bench(frames, arguments.out / group).rows for group, frames in groups.items()}
    text = with_published_rows(table, ours, data.card)
    with replacing(arguments.out / f"{arguments.paper}.md") as temporary:
        temporary.write_text(text + "\n", "utf-8")
    print_lines(text)
    return 0


def _frames(data: "ScanData", part: "Part") -> "Frames":
    """The scans of a part; one that is named twice is one."""
    from derain.sources.source import Frames

    return Frames({frame.name: frame for frame in data.frames(part)}.values())


def _labelled_frames(
    data: "ScanData", frames: Sequence["Frame"], rates: Mapping[str, float]
) -> "LabelledFrames":
    """Scans of a data set, read and counted as the data module would."""
    from derain.export.bench.labelled_frames import LabelledFrames

    return LabelledFrames(data.card, frames, data.loading.intensity_scale, data.distinct, rates)


def _learn_from(data: "ScanData", training: "ScanData | None") -> "LearnFrom | None":
    """What gives the training scans: those named, or else those of a data set; None without."""
    from derain.datamodules.scan_data import SequenceData, TaughtData

    if training is None and not isinstance(data, SequenceData | TaughtData):
        return None
    scans = training or data
    # Found only when they are asked for: a bench without such a baseline needs no training scans.
    return lambda: _labelled_frames(scans, _frames(scans, "train"), {}).truths()
