"""Labels recordings by a method, to train a network.

The labels are 0 for not rain, 1 for rain, and 255 for not known. Training and measuring leave out
points that are not known.

  derain teach drive/ --out taught
  derain teach drive/ --out taught --poses poses.txt
  derain teach crf drive/ other_drive/ --out taught
  derain teach persistence drive/ --out taught
  derain teach persistence WADS/sequences/36 --out taught --card wads
  derain fit --config cues_taught.yaml --data.root taught --start default

METHOD is a method that sees several scans, a filter, the model that comes with derain (below), a
model of your own (.onnx), or parameters from `derain tune` (.yaml). It is optional: if the first
word is a folder or a scan, the model that comes with derain labels all scans, also using the scans
around each. derain writes the labels, their data card and a list of the scans; the scans stay in
their place. The last fifth of each sequence is the validation part. Scans without any known point
are left out.
For more than --block scans derain keeps records in --out: a run that was stopped resumes, and
`derain status` prints its progress. Processes, a Dask cluster and shards write the same bytes; no
training takes the labels before all are there. If scans of a shard failed, the same command without
--shard completes the labels.
With --card, the data card of the scans' own labels, derain also compares its labels with these, for
the record only: they do not change the result.
"""

import argparse
import sys
from pathlib import Path

from derain.annotation.teach import LabelledScan, refuse_to_overwrite, teach
from derain.cards.card import load_card, packaged_cards
from derain.cards.known import layouts_for
from derain.cli import options, unit_options
from derain.cli.method_options import add_method_and_scans, method_and_scans, method_of
from derain.cli.outputs import exit_code, print_error, print_facts, print_lines
from derain.cli.parser import Parser
from derain.errors import counted
from derain.evaluation.counts import or_none
from derain.evaluation.text_tables import number_text
from derain.export.methods import over_recording
from derain.sources.folders import named_frames
from derain.sources.judging import Failures


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    add_method_and_scans(parser, help="folders of consecutive scans, or a data set's folder")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--card",
        help="data card of the scans' own labels, to compare with for the record: "
        f"{', '.join(packaged_cards())}, or a YAML file",
    )
    options.add_json(parser)
    options.add_columns(parser)
    options.add_topic(parser)
    options.add_intensity_scale(parser)
    options.add_poses(parser)
    unit_options.add_units(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    division = unit_options.division_of(arguments)
    name, scans = method_and_scans(arguments.method, arguments.scans or [], "teach", "taught")
    method = over_recording(method_of(name, arguments))
    card = None if arguments.card is None else load_card(arguments.card)
    found = named_frames(
        scans,
        arguments.columns,
        labelled=True,
        layouts=layouts_for(card),
        recordings=True,
        topic=arguments.topic,
    )
    refuse_to_overwrite(arguments.out, found)
    source = unit_options.prepared(found, arguments)
    method, workers = unit_options.method_and_workers(
        method, lambda: over_recording(method_of(name, arguments)), source, arguments
    )
    failures = Failures(print_error)
    with unit_options.executor_of(arguments, workers) as executor:
        results = teach(
            method,
            source,
            arguments.out,
            card=card,
            guard=failures.skipping_failures,
            watch=lambda scan: _print_labels(scan, arguments.json),
            division=division,
            executor=executor,
        )
    stream = sys.stderr if arguments.json else sys.stdout
    print_lines(f"{counted(results.judged, 'scan')}\n{results.answers}", stream)
    record = results.record
    if record is not None and record.scans:
        print_lines(
            f"for the record only, beside {record.card.title}'s own labels of "
            f"{counted(record.scans, 'scan')}, which changed nothing:\n{record}",
            stream,
        )
    if not results.manifest.finished:
        print_lines(f"Progress of the other shards: derain status {arguments.out}", stream)
    failed = len(failures.errors)
    return exit_code(failed, len(source), "{scans} could not be judged, and have no labels")


def _print_labels(scan: LabelledScan, as_json: bool) -> None:
    not_rain, rain, not_known = map(or_none, scan.answers.shares.tolist())
    facts = {
        "scan": scan.frame.name,
        "points": scan.answers.points,
        "rain": rain,
        "not_rain": not_rain,
        "not_known": not_known,
        "milliseconds": dict(scan.milliseconds),
    }
    text = (
        f"{scan.frame.name}: {scan.answers.points:,} valid points, "
        f"{number_text(rain, '.1%')} rain, {number_text(not_rain, '.1%')} not rain, "
        f"{number_text(not_known, '.1%')} not known, {sum(scan.milliseconds.values()):.0f} ms"
    )
    print_facts(facts, text, as_json)
