"""``derain teach``: labels recordings by a method, for a network to learn from."""

import argparse
import sys
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, TextIO

from derain.bags.names import within
from derain.cards.card import load_card, packaged_cards
from derain.cards.known import layouts_for
from derain.cli.arguments import add_threads
from derain.cli.method_options import add_method, add_parameters, add_runtime, method_of, runtime_of
from derain.cli.outputs import ScanByScan, exit_code, print_facts, print_lines
from derain.cli.scan_options import add_columns, add_intensity_scale, add_poses, add_topic
from derain.errors import printable
from derain.evaluation.counts import or_none
from derain.evaluation.text_tables import number_text
from derain.sources.folders import named_frames
from derain.system.memory import keep_freed_memory
from derain.workflows.odometry import placed

if TYPE_CHECKING:
    from derain.workflows.teaching import LabelledScan, TeachResults

DESCRIPTION = """\
Labels recordings by a method, to train a network: 0 is not rain, 1 rain, and 255 not known.
Training and measuring leave out points that are not known.

  derain teach persistence drive/ --out taught
  derain teach persistence drive/ --out taught --poses poses.txt
  derain teach crf drive/ other_drive/ --out taught
  derain teach default drive/ --out taught
  derain teach persistence WADS/sequences/36 --out taught --card wads
  derain fit --config outdet_taught.yaml --data.root taught

METHOD is a method that sees several scans, a filter, the model that comes with derain (below), a
model of your own (.onnx), or parameters from `derain tune` (.yaml). derain writes the labels, their
data card and a list of the scans; the scans stay in their place. The last fifth of each sequence is
the validation part. Scans without any known point are left out.
With --card, the meaning of the scans' own labels, derain also compares its labels with these, for
the record only: they do not change the result.
"""


@dataclass(frozen=True)
class TaughtFacts:
    """What is printed of one scan.

    Attributes:
        scan: Its file.
        points: Its valid points.
        rain: Share of them labelled rain; None, as for those below, without valid points.
        not_rain: Share of them labelled not rain.
        not_known: Share of them labelled not known.
        milliseconds: By stage.
    """

    scan: str
    points: int
    rain: float | None
    not_rain: float | None
    not_known: float | None
    milliseconds: dict[str, float]

    @classmethod
    def of(cls, scan: "LabelledScan") -> "TaughtFacts":
        """The facts of a labelled scan."""
        not_rain, rain, unknown = map(or_none, scan.answers.shares.tolist())
        return cls(scan.name, scan.answers.points, rain, not_rain, unknown, dict(scan.milliseconds))

    def __str__(self) -> str:
        return (
            f"{printable(self.scan)}: {self.points:,} valid points, "
            f"{number_text(self.rain, '.1%')} rain, {number_text(self.not_rain, '.1%')} not rain, "
            f"{number_text(self.not_known, '.1%')} not known, "
            f"{sum(self.milliseconds.values()):.0f} ms"
        )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    add_method(parser)
    parser.add_argument(
        "scans", nargs="+", type=Path, help="folders of consecutive scans, or a data set's folder"
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--card",
        help="data card of the scans' own labels, to compare with for the record: "
        f"{', '.join(packaged_cards())}, or a YAML file",
    )
    add_threads(parser)
    add_runtime(parser, help="what runs a model")
    parser.add_argument("--json", action="store_true", help="print one JSON object per scan")
    add_columns(parser)
    add_topic(parser)
    add_intensity_scale(parser)
    add_parameters(parser)
    add_poses(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.annotation.teach import refuse_to_overwrite
    from derain.workflows.teaching import teach_recordings

    keep_freed_memory()
    runtime = runtime_of(arguments.runtime, arguments.precision)
    settings = dict(arguments.set)
    method = method_of(arguments.method, arguments.parameters, settings, arguments.threads, runtime)
    card = None if arguments.card is None else load_card(arguments.card)
    found = named_frames(
        within(arguments.scans, arguments.topic),
        arguments.columns,
        labelled=True,
        layouts=layouts_for(card),
        recordings=True,
    )
    refuse_to_overwrite(arguments.out, found)
    source = placed(found, arguments.poses, arguments.threads).map(
        lambda frame: frame.with_intensity_times(arguments.intensity_scale)
    )
    scans = ScanByScan(source)
    results = teach_recordings(
        method,
        source,
        arguments.out,
        card=card,
        guard=scans.skipping_failures,
        watch=lambda scan: print_facts(TaughtFacts.of(scan), arguments.json),
    )
    _show(results, sys.stderr if arguments.json else sys.stdout)
    failed = len(scans.errors)
    return exit_code(failed, len(source), "{scans} could not be judged, and have no labels")


def _show(results: "TeachResults", stream: TextIO) -> None:
    """Prints the counts of all scans."""
    print_lines(f"{results.judged:,} scans\n{results.answers}", stream)
    record = results.record
    if record is not None and record.scans:
        print_lines(
            f"for the record only, beside {record.card.title}'s own labels of "
            f"{record.scans:,} scans, which changed nothing:\n{record}",
            stream,
        )
