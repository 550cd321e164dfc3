r"""Compares methods on the same labelled scans: error, time and memory.

Writes a table (bench.md, bench.csv, bench.json) and a plot of error against time (speed_error.png).

  derain bench --data scans/ --card wads --methods default outdet.onnx dror dsor all none \
      --out bench
  derain bench --data DATASET --methods outdet.onnx int8=outdet_int8.onnx tuned=dsor.yaml \
      position intensity all none --out bench
  derain bench --data scans/ --card wads --methods outdet.onnx --runtime openvino \
      --precision bf16 --out bench
  derain bench --data test/ --train train/ --card wads --methods position intensity --out bench
  derain bench --data drives/ --methods default dror none --workers 8 --out bench
  derain bench --paper table2 --data REHEARSE3D_PUBLIC --methods outdet.onnx salsanext.onnx \
      lisnownet.onnx dsor.yaml dror.yaml position all none --out table2
  derain bench --paper table3 --data REHEARSE3D_PUBLIC --rain-rates rates.yaml \
      --methods outdet.onnx dsor.yaml position all none --out table3

A method is a model (.onnx), parameters from `derain tune` (.yaml), default or a filter (below), or
a baseline: position and intensity, learnt from the training scans, all and none.
With --runtime, each model has a second row for that runtime.
Scoring runs all methods in one process, where filters share one neighbour search, or unit by unit
in processes (--workers), shards or a Dask cluster, with the same figures. For more than --block
scans derain keeps records in --out: a bench that was stopped resumes, and `derain status` prints
its progress. Each method is then timed alone, in its own process, by the command that scores the
last unit.
"""

import argparse
from collections.abc import Sequence
from functools import partial
from pathlib import Path

from derain.cli import unit_options
from derain.cli.method_options import add_runtime, list_methods, runtime_of
from derain.cli.options import (
    add_data,
    add_seed,
    add_threads,
    command_line,
    count,
    labelled,
)
from derain.cli.outputs import print_lines
from derain.cli.parser import Parser
from derain.datamodules.labelled import LabelledScans, rain_rates
from derain.datamodules.scan_data import Part
from derain.errors import InputError
from derain.evaluation.published_tables import TABLES, paper_table, scans_by_group
from derain.export.bench.bench import Bench, count_in_units, run_bench
from derain.export.bench.bench_entries import bench_entries
from derain.export.bench.cost import Effort
from derain.export.bench.labelled_frames import LabelledFrames
from derain.export.bench.report import with_published_rows
from derain.files.atomic import require_writable_folder, write_text
from derain.sources.frame import Frame
from derain.sources.source import Frames
from derain.sources.spread import evenly_spaced


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    add_data(parser, part="test")
    list_methods(parser, of_recordings=False)
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
    add_seed(parser)
    unit_options.add_units(parser, workers="1")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    data = labelled(arguments.data, arguments, arguments.topic)
    training = data
    if arguments.train:
        training = labelled(arguments.train, arguments, arguments.topic)
    rates = rain_rates(arguments.data, arguments.rain_rates)

    def labelled_frames(scans: LabelledScans, frames: Sequence[Frame]) -> LabelledFrames:
        return LabelledFrames(scans.reader, frames, rates)

    # Read at their first use: a bench without such a baseline needs no training scans.
    methods = bench_entries(
        arguments.methods,
        (lambda: labelled_frames(training, _frames(training, "train")).truths())
        if arguments.train or data.has_parts
        else None,
        runtime_of(arguments),
    )
    require_writable_folder(arguments.out)
    effort = Effort(arguments.threads, arguments.timed, arguments.repeats, arguments.seed)

    division, workers = unit_options.division_of(arguments), arguments.workers or 1
    command = command_line(arguments, without=unit_options.UNIT_OPTIONS)
    unit_options.share_threads(arguments, workers)

    def bench(frames: Sequence[Frame], out: Path) -> Bench | None:
        """Benches the methods on some of the scans, and writes tables and picture.

        Returns None while other shards are to be scored.
        """
        chosen = labelled_frames(data, evenly_spaced(frames, arguments.limit or len(frames)))
        with unit_options.executor_of(arguments, workers) as executor:
            counted = count_in_units(methods, chosen, arguments.threads, out, division, executor)
        if counted is None:
            print_lines(f"Progress of the other shards: derain status {out}")
            return None
        found = run_bench(methods, chosen, effort, command, counted)
        found.write(out)
        return found

    if arguments.paper is None:
        frames = _frames(data, arguments.part)
        if arguments.rain_rates and not any(frame.sequence in rates for frame in frames):
            reason = "names no sequence of these scans"
            remedy = f'Name them by their folders, as "{frames[0].sequence}": 25.'
            raise InputError(arguments.rain_rates, reason, remedy)
        found = bench(frames, arguments.out)
        if found is not None:
            print_lines(str(found))
        return 0
    if not data.has_parts:
        reason = "has no split, which the paper's tables need"
        raise InputError(arguments.data[0], reason, "Name the root.")
    table = paper_table(arguments.paper)
    groups = scans_by_group(table, partial(_frames, data), lambda frame: rates.get(frame.sequence))
    benches = {group: bench(frames, arguments.out / group) for group, frames in groups.items()}
    ours = {group: found.rows for group, found in benches.items() if found is not None}
    if len(ours) < len(benches):
        return 0
    text = with_published_rows(table, ours, data.card)
    write_text(arguments.out / f"{arguments.paper}.md", text + "\n")
    print_lines(text)
    return 0


def _frames(data: LabelledScans, part: Part) -> Frames:
    """The scans of a part; one that is named twice is one."""
    return Frames({frame.name: frame for frame in data.frames(part)}.values())
