"""Describes scans, label files, bags, exported models, checkpoints and data sets.

For a scan it also prints the grid of the range image that fits. For a data set (a folder of
sequences as of REHEARSE-3D, SemanticKITTI or WADS, or simulated; one sequence; or a folder of
scans) it counts scans and points by class and rain rate. With --grid it fits one grid to all scans,
for a configuration. `derain info default` prints the card of the model that comes with derain: what
it is, how good it is, and when not to use it. Processes (--workers), a Dask cluster (--dask) or
shards (--shard) count many scans. With --out derain keeps records: a count that was stopped
resumes, and `derain status` prints its progress.

  derain info default
  derain info scan.bin
  derain info scan.bin --columns x,y,z,intensity,ring --json
  derain info labels/000000.label
  derain info model.onnx
  derain info --grid scans
  derain info drive.mcap
  derain info drive.mcap/velodyne_points/000012
  derain info REHEARSE3D_PUBLIC --picture statistics.png
  derain info WADS --json
  derain info drives/ --out counts --workers 8
  derain info my_data --card my_card.yaml
"""

import argparse
import json
import os
import sys
from collections.abc import Mapping, Sequence
from dataclasses import asdict
from pathlib import Path
from textwrap import indent, wrap
from typing import Any

import yaml

from derain.bags.names import in_bag, is_bag
from derain.cli.info_file import facts_of_file
from derain.cli.info_folder import draw, facts_of_folder
from derain.cli.options import add_columns, add_topic, picture
from derain.cli.outputs import print_lines
from derain.cli.unit_options import add_executor, add_shard, executor_of
from derain.default import DEFAULT, ModelCard, default_model, model_card
from derain.errors import InputError, printable
from derain.evaluation.text_tables import number_text, plain_table
from derain.example import or_example
from derain.files.documents import Entry
from derain.files.format import FORMATS
from derain.sources.folders import named_frames
from derain.stores.url import paths_of, place_of
from derain.system.extras import MATPLOTLIB, require
from derain.system.notices import warn
from derain.views.candidates import candidates_at
from derain.views.grid_fit import fit_grid

# Letters of a line, as in every document of derain.
LINE_LENGTH = 100


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "files", nargs="+", help="scans, labels, models, checkpoints, folders, bags, or default"
    )
    parser.add_argument("--grid", action="store_true", help="fit one grid to all the scans")
    parser.add_argument(
        "--json", action="store_true", help="print one JSON object per file or folder"
    )
    parser.add_argument(
        "--card",
        help="data card with the classes and folders of a data set (default: found by its folders)",
    )
    parser.add_argument(
        "--picture",
        type=picture,
        help="draw a folder's statistics to this file, such as .png",
    )
    group = parser.add_argument_group("a folder of many scans")
    add_executor(group, "processes that count a folder's points (default: 1)")
    add_shard(group)
    group.add_argument(
        "--out",
        type=place_of,
        help="folder or URL for records of the counts: the same command resumes where it was "
        "stopped, and shards add up",
    )
    group.add_argument("--anew", action="store_true", help="count everything again")
    parser.add_argument(
        "--formats", action=_ListFormats, nargs=0, help="list the formats of scans, and exit"
    )
    add_columns(parser)
    add_topic(parser)


class _ListFormats(argparse.Action):
    """Prints the formats of scan files that there are, a line each, and ends the command."""

    def __call__(self, parser: argparse.ArgumentParser, *_: object) -> None:
        suffixes: dict[str, list[str]] = {}
        for suffix, format_ in FORMATS.items():
            needs = f" (needs derain[{format_.EXTRA.name}])" if format_.EXTRA else ""
            suffixes.setdefault(format_.HELP + needs, []).append(suffix)
        print("formats of scans, each of them also compressed as .gz:")
        for what, names in suffixes.items():
            print(f"  {', '.join(names):<24}{what}")
        parser.exit()


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    one_folder = len(arguments.files) == 1 and os.path.isdir(arguments.files[0])
    if arguments.picture:
        if arguments.grid or not one_folder:
            raise InputError("--picture", "shows one folder's statistics", "Name one folder alone.")
        require("--picture", MATPLOTLIB)
    if arguments.out is not None and (arguments.grid or not one_folder):
        raise InputError("--out", "keeps records of one folder", "Name one folder alone.")
    if arguments.out is None and (arguments.shard is not None or arguments.anew):
        option = "--anew" if arguments.anew else "--shard"
        raise InputError(option, "needs a folder of records", "Name one by --out.")
    if arguments.grid:
        frames = named_frames(arguments.files, arguments.columns, topic=arguments.topic)
        fit = fit_grid([frame.read() for frame in frames]).as_dict()
        print(json.dumps(fit) if arguments.json else yaml.safe_dump(fit, sort_keys=False).rstrip())
        return 0
    code = 0
    for name in arguments.files:
        try:
            _describe(name, arguments)
        except InputError as error:  # the other files are none the worse for it
            print(f"derain: {error}", file=sys.stderr)
            code = 2
    return code


def _describe(name: str, arguments: argparse.Namespace) -> None:
    """Prints what is in one file or folder."""
    if name == DEFAULT:  # not ./default, which is a file or folder; a Path would make both the same
        _describe_default(arguments.json)
        return
    [path] = paths_of([name])
    path = in_bag(or_example(path), arguments.topic)
    if os.path.isdir(path) and not is_bag(path):
        _describe_folder(path, arguments)
        return
    facts = facts_of_file(path, arguments.columns)
    if arguments.json:
        print(json.dumps({"file": str(path), **facts}))
    else:
        print_lines(f"{printable(str(path))}\n{_indented(_in_brief(facts))}")


def _describe_default(as_json: bool) -> None:
    """Prints the card of the model that comes with derain, once its file is known to be it."""
    if os.path.exists(DEFAULT):
        reason = "it names the model that comes with derain, and also a file or folder here"
        remedy = f"Write ./{DEFAULT} for the file or folder, or run the command in another folder."
        raise InputError(DEFAULT, reason, remedy)
    model, card = default_model(), model_card()
    if as_json:
        print(json.dumps({"file": str(model), **asdict(card)}))
    else:
        print_lines(card_as_text(card, model.stat().st_size))


def _describe_folder(folder: Path, arguments: argparse.Namespace) -> None:
    with executor_of(arguments, arguments.workers or 1) as executor:
        facts = facts_of_folder(folder, arguments, executor)
    if facts is None:
        print_lines(f"Progress of the other shards: derain status {arguments.out}")
        return
    print_lines(json.dumps(facts.as_dict()) if arguments.json else facts.as_text())
    if arguments.card is not None and not facts.total.labelled:
        warn(
            f"{folder}: no labels are beside its scans or in a folder that the card names: "
            f"`layout: {{scans: {folder.absolute().name}, labels: FOLDER}}` in a YAML card names it"
        )
    if arguments.picture:
        draw(facts, arguments.picture)


def _in_brief(facts: dict[str, Any]) -> dict[str, Any]:
    """The same with a model's candidates in words, and the record of its training as counts.

    That may name 2,000 scans.
    """
    match facts:
        case {"spec": {"training": dict(training)}}:
            counts = {kind: f"{len(names):,}" for kind, names in training.items()}
            entry = Entry("model", "candidates", facts["spec"].get("candidates"))
            candidates = candidates_at(entry)
            brief = {"training": counts, "candidates": candidates or "every point"}
            return {**facts, "spec": {**facts["spec"], **brief}}
    return facts


def _indented(facts: dict[str, Any], depth: int = 1) -> str:
    lines = []
    for name, fact in facts.items():
        title = f"{'  ' * depth}{name}:"
        if isinstance(fact, list) and fact and isinstance(fact[0], dict):
            fact = len(fact)
        if not isinstance(fact, dict):
            lines.append(f"{title} {fact}")
        elif any(isinstance(value, dict | list) for value in fact.values()):
            lines.append(f"{title}\n{_indented(fact, depth + 1)}")
        else:
            inline = ", ".join(f"{key} {value}" for key, value in fact.items())
            lines.append(f"{title} {inline}")
    return "\n".join(lines)


def card_as_text(card: ModelCard, size: int) -> str:
    """A card in lines for the screen.

    Args:
        card: The card.
        size: Bytes of the model's file.
    """
    parts: dict[str, Sequence[str]] = {
        "what it is": [card.what],
        "when not to use it": card.not_for,
        "how good it is": [],
        "measured by": [card.measured],
        "threshold": [f"{card.threshold:g}: {card.threshold_chosen}"],
        "learnt from": [card.data],
        "made by": card.training,
        "seed": [str(card.seed)],
        "licence": [card.licence],
        "sha256": [card.sha256],
    }
    lines = [f"{card.title}, {size:,} bytes"]
    for heading, paragraphs in parts.items():
        lines.append(f"  {heading}:")
        for paragraph in paragraphs:
            lines += wrap(paragraph, LINE_LENGTH, initial_indent=" " * 4, subsequent_indent=" " * 6)
        if heading == "how good it is":
            lines.append(_scores(card.scores))
    return "\n".join(lines)


def _scores(scores: Sequence[Mapping[str, Any]]) -> str:
    """A table of scores: a line of headings, and a line for each data set."""
    if not scores:
        return "    not measured"
    rows = [
        [one["data"], number_text(one.get("iou")), number_text(one.get("taken"), ".3%")]
        for one in scores
    ]
    return indent(plain_table([["", "IoU", "taken"], *rows]), "  ")
