"""``derain bench``: methods side by side, speed against error."""

import argparse
import sys
from collections.abc import Iterator, Mapping, Sequence
from functools import partial
from pathlib import Path
from typing import TYPE_CHECKING, Any

from tqdm import tqdm

from derain.cli.arguments import command_line, count, threads
from derain.cli.labelled_data import add_data_arguments, labelled
from derain.cli.outputs import refuse_unwritable, say
from derain.errors import InputError
from derain.files.atomic import replacing
from derain.sources.training_record import overlap
from derain.spec import Spec
from derain.system.notices import Notices
from derain.views.oddities import oddities

if TYPE_CHECKING:
    from derain.cards.card import DataCard
    from derain.datamodules.base import ScanDataModule
    from derain.export.bench.contestants import Contestant
    from derain.export.bench.rows import Row
    from derain.scan import Scan
    from derain.sources.frame import Frame

SUMMARY = "compare methods on labelled scans: error, time and memory"

DESCRIPTION = """\
Runs every method on the same labelled scans, and writes one table (bench.md, bench.csv, bench.json)
and one picture of error against time (speed_error.png).

  derain bench --data scans/ --card wads --methods outdet.onnx dror dsor all none --out bench
  derain bench --data DATASET --methods outdet.onnx int8=outdet_int8.onnx tuned=dsor.yaml \\
      position intensity all none --out bench
  derain bench --data test/ --train train/ --card wads --methods position intensity --out bench
  derain bench --paper table2 --data REHEARSE3D_PUBLIC --methods outdet.onnx salsanext.onnx \\
      lisnownet.onnx dsor.yaml dror.yaml position all none --out table2
  derain bench --paper table3 --data REHEARSE3D_PUBLIC --rain-rates rates.yaml \\
      --methods outdet.onnx dsor.yaml position all none --out table3

A method is a model (.onnx), parameters that `derain tune` wrote (.yaml), a filter (ror, sor, dror,
dsor, ssr), or a baseline: position and intensity, learnt from the training scans, all and none.
Scoring runs all methods in this process, where filters share one search for neighbours; then each
is timed alone, in a process of its own.
"""

# Scans that the two baselines learn from; spread over all training scans.
MOST_TRAINING_SCANS = 200


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    add_data_arguments(parser, part="test")
    parser.add_argument("--methods", nargs="+", required=True, metavar="[TITLE=]METHOD")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--train",
        type=Path,
        nargs="+",
        help="labelled scans that position and intensity learn from "
        "(default: the training part of a data set)",
    )
    parser.add_argument("--limit", type=count, help="scans, spread over all (default: all)")
    parser.add_argument(
        "--distinct",
        action=argparse.BooleanOptionalAction,
        help="count points at one position once, as results on WADS are published "
        "(default: as the data card says)",
    )
    parser.add_argument(
        "--rain-rates",
        type=Path,
        metavar="YAML",
        help='rain rate of each sequence in mm/h, as "005": 25 (default: a simulation\'s own)',
    )
    parser.add_argument("--paper", choices=("table2", "table3"), help="print beside this table")
    parser.add_argument("--threads", type=threads, default=0, help="threads (default: all cores)")
    parser.add_argument(
        "--timed", type=count, default=10, help="scans to time on (default: %(default)s)"
    )
    parser.add_argument(
        "--repeats", type=count, default=3, help="timed runs on each (default: %(default)s)"
    )
    parser.add_argument("--seed", type=int, default=0, help="of the intervals' draws (default: 0)")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.datamodules.labelled import rain_rates
    from derain.export.bench.contestants import contestants
    from derain.export.bench.paper import beside_published, files_by_group, paper_table
    from derain.export.bench.report import main_table

    data = labelled(arguments, arguments.data)
    rates = rain_rates(arguments.data, arguments.rain_rates)
    methods = contestants(arguments.methods, _learn_from(arguments, data))
    refuse_unwritable(arguments.out / "bench.json")
    if arguments.paper is None:
        rows = _bench(arguments, data, data.frames(arguments.part), rates, methods, arguments.out)
        say(main_table(rows))
        return 0
    _require_split(arguments, data)
    table = paper_table(arguments.paper)
    ours = {
        group: _bench(arguments, data, files, rates, methods, arguments.out / group)
        for group, files in files_by_group(table, data, rates).items()
    }
    text = beside_published(table, ours, data.card)
    with replacing(arguments.out / f"{arguments.paper}.md") as temporary:
        temporary.write_text(text + "\n", "utf-8")
    say(text)
    return 0


def _bench(
    arguments: argparse.Namespace,
    data: "ScanDataModule",
    files: Sequence["Frame"],
    rates: Mapping[str, float],
    methods: Sequence["Contestant"],
    out: Path,
) -> list["Row"]:
    """Benches the methods on some scans, and writes tables and picture."""
    from derain.cards.layout import sequence_of
    from derain.datamodules.statistics import evenly_spaced
    from derain.export.bench.bench import provenance, run_bench
    from derain.export.bench.cost import Timing
    from derain.export.bench.report import write_report
    from derain.export.bench.scores import Labelled
    from derain.export.bench.speed_error import draw_speed_error

    notices = Notices()
    files = evenly_spaced(files, arguments.limit or len(files))
    by_scan = {Path(frame.name): frame for frame in files}
    known_rates = {scan: rates[sequence_of(scan)] for scan in by_scan if sequence_of(scan) in rates}
    scans = Labelled(
        data.card,
        list(by_scan),
        partial(_read, data, by_scan, methods, notices),
        known_rates,
        data.distinct,
    )
    timing = Timing(
        evenly_spaced(scans.scans, arguments.timed),
        data.loading.columns,
        arguments.threads,
        arguments.repeats,
        data.loading.intensity_scale,
    )
    notes = _notes(methods, data.card, files)
    rows = run_bench(methods, scans, timing, arguments.seed)
    notices.tell_how_many_more()
    facts = provenance(command_line(arguments), data, files, timing, arguments.seed)
    facts["notes"] = notes
    write_report(rows, facts, out)
    draw_speed_error(rows, facts, out / "speed_error.png")
    return rows


def _read(
    data: "ScanDataModule",
    files: Mapping[Path, "Frame"],
    methods: Sequence["Contestant"],
    notices: Notices,
    scan: Path,
) -> "Scan":
    """Reads a scan, and warns of what is odd about it for each method."""
    read = data.read(files[scan])
    for method in methods:
        notices.tell(str(scan), oddities(read, method.judge), method.title)
    return read


def _notes(
    methods: Sequence["Contestant"], card: "DataCard", frames: Sequence["Frame"]
) -> list[str]:
    """Says, and gives back, which models were trained on what they are measured on."""
    notes = [
        note
        for method in methods
        if isinstance(method.judge, Spec)
        and (note := overlap(method.title, method.judge, card, frames))
    ]
    for note in notes:
        tqdm.write(f"derain: warning: {note}", sys.stderr)
    return notes


def _learn_from(arguments: argparse.Namespace, data: "ScanDataModule") -> Any:
    """What gives the training scans; None where none are named."""
    from derain.datamodules.sequences import SequenceDataModule
    from derain.datamodules.statistics import evenly_spaced
    from derain.evaluation.baselines import known_truth

    if arguments.train is None and not isinstance(data, SequenceDataModule):
        return None
    training = data if arguments.train is None else labelled(arguments, arguments.train)

    def scans() -> Iterator[Any]:
        for file in evenly_spaced(training.frames("train"), MOST_TRAINING_SCANS):
            yield known_truth(training.read_measured(file), training.card)

    return scans


def _require_split(arguments: argparse.Namespace, data: "ScanDataModule") -> None:
    from derain.datamodules.sequences import SequenceDataModule

    if not isinstance(data, SequenceDataModule):
        raise InputError(
            arguments.data[0], "has no split, which the paper's tables ask for", "Name the root."
        )
