"""``derain info``: what is in a scan, a label file, a model or a data set."""

import argparse
import json
import os
import sys
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from textwrap import wrap
from typing import Any

import numpy as np
import yaml

from derain.bags.names import is_bag, split, within
from derain.cards.card import load_card
from derain.cards.known import layouts_for
from derain.cli.info_bag import facts_of_bag
from derain.cli.info_folder import draw, facts_of_folder
from derain.cli.info_scan import facts_of_scan
from derain.cli.outputs import print_lines
from derain.cli.scan_options import ListFormats, add_columns, add_topic
from derain.default import DEFAULT, ModelCard, ModelScore, default_model, model_card
from derain.errors import InputError, printable
from derain.evaluation.text_tables import number_text
from derain.files.documents import Entry
from derain.files.labels import read_labels, semantic
from derain.files.reading import reading
from derain.sources.folders import frame_of, named_frames
from derain.system.extras import CHECKPOINT_LIBRARIES, MATPLOTLIB, require
from derain.system.notices import warn
from derain.views.candidates import candidates_at
from derain.views.grid_fit import fit_grid
from derain.views.scan_issues import no_points

DESCRIPTION = """\
Describes scans, label files, bags, exported models and checkpoints. For a scan it also prints the
range image that fits, and how many rays have two returns; with --card, how often the second return
of a labelled scan is the surface behind rain. For a data set (a folder of sequences as of
REHEARSE-3D, SemanticKITTI or WADS, or simulated; one sequence; or a folder of scans) it counts
scans and points by class and rain rate. With --grid it fits one grid to all scans, for a
configuration. `derain info default` prints the card of the model that comes with derain: what it
is, how good it is, and when not to use it.

  derain info default
  derain info scan.bin
  derain info scan.bin --columns x,y,z,intensity,ring --json
  derain info velodyne/042228.bin --card wads
  derain info labels/000000.label
  derain info model.onnx
  derain info --grid scans
  derain info drive.mcap
  derain info drive.mcap/velodyne_points/000012
  derain info REHEARSE3D_PUBLIC --picture statistics.png
  derain info WADS --json
  derain info my_data --layout lidar,classes --card my_card.yaml
"""


@dataclass(frozen=True)
class Options:
    """How files and folders are described.

    Attributes:
        card: Name or file of their data card; None finds that of a folder.
        layout: Names of a sequence's folders of scans and labels; None finds them.
        columns: Names of the columns of files that do not name them.
        topic: Topic of point clouds, in bags.
        picture: File for a picture of a folder's statistics.
        as_json: Whether each line is a JSON object.
    """

    card: str | None
    layout: str | None
    columns: tuple[str, ...]
    topic: str | None
    picture: Path | None
    as_json: bool


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
        help="data card with the classes and folders of a data set (default: found by its "
        "folders), or with the rain classes of a labelled scan",
    )
    parser.add_argument(
        "--layout",
        metavar="SCANS,LABELS",
        help="names of a sequence's folders of scans and labels (default: known names)",
    )
    parser.add_argument("--picture", type=Path, help="draw a folder's statistics to this PNG file")
    parser.add_argument(
        "--formats", action=ListFormats, nargs=0, help="list the formats of scans, and exit"
    )
    add_columns(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    if arguments.picture:
        if arguments.grid or len(arguments.files) > 1 or not os.path.isdir(arguments.files[0]):
            raise InputError("--picture", "shows one folder's statistics", "Name one folder alone.")
        require("--picture", MATPLOTLIB)
    if arguments.grid:
        paths = within([Path(name) for name in arguments.files], arguments.topic)
        frames = named_frames(paths, arguments.columns)
        fit = fit_grid([frame.read() for frame in frames]).as_dict()
        print(json.dumps(fit) if arguments.json else yaml.safe_dump(fit, sort_keys=False).rstrip())
        return 0
    options = Options(
        arguments.card,
        arguments.layout,
        arguments.columns,
        arguments.topic,
        arguments.picture,
        arguments.json,
    )
    code = 0
    for name in arguments.files:
        try:
            _describe(name, options)
        except InputError as error:  # the other files are none the worse for it
            print(f"derain: {error}", file=sys.stderr)
            code = 2
    return code


def _describe(name: str, options: Options) -> None:
    """Prints what is in one file or folder."""
    if name == DEFAULT:  # not ./default, which is a file or folder; a Path would make both the same
        _describe_default(options.as_json)
        return
    path = within([Path(name)], options.topic)[0]
    if os.path.isdir(path) and not is_bag(path):
        _describe_folder(path, options)
        return
    facts = _facts(path, options.card, options.columns)
    if options.as_json:
        print(json.dumps({"file": str(path), **facts}))
    else:
        print(printable(str(path)))
        print_lines(_indented(_in_brief(facts)))


def _describe_default(as_json: bool) -> None:
    """Prints the card of the model that comes with derain, once its file is known to be it."""
    if os.path.exists(DEFAULT):
        raise InputError(
            DEFAULT,
            "it is the model that comes with derain, and a file or folder here has its name",
            f"Write ./{DEFAULT} for that, or ask from another folder.",
        )
    model, card = default_model(), model_card()
    if as_json:
        print(json.dumps({"file": str(model), **card.as_dict()}))
    else:
        print_lines(card_as_text(card, model.stat().st_size))


def _describe_folder(folder: Path, options: Options) -> None:
    facts = facts_of_folder(folder, options.card, options.layout, options.columns)
    print_lines(json.dumps(facts.as_dict()) if options.as_json else facts.as_text())
    if options.card is not None and not facts.total.labelled:
        warn(
            f"{folder}: no labels are beside its scans or in a folder that the card names. Name "
            f"the folders of scans and labels, as in --layout {folder.absolute().name},labels"
        )
    if options.picture:
        draw(facts, options.picture)


def _facts(path: Path, card_name: str | None, columns: Sequence[str]) -> dict[str, Any]:
    if is_bag(path):
        return facts_of_bag(path)
    with reading(path):
        exists = path.exists() or split(path) is not None
    if not exists:
        raise InputError(path, "there is no such file or folder", "Check the path.")
    match path.suffix.lower():
        case ".label":
            return _of_labels(path)
        case ".onnx":
            from derain.export.runtime import Derainer

            return Derainer(path, threads=1).metadata
        case ".ckpt":
            require(path, *CHECKPOINT_LIBRARIES)
            from derain.models.checkpoint import load_model

            model = load_model(path)
            weights = sum(parameter.numel() for parameter in model.parameters())
            return {"spec": dict(model.hparams["spec"]), "parameters": weights}
        case ".pt" | ".pth":
            raise InputError(
                path,
                "weights alone do not say how they are used",
                "Make a checkpoint of them with `derain import-weights`.",
            )
        case _:
            card = None if card_name is None else load_card(card_name)
            frame = frame_of(path, columns, layouts_for(card))
            scan = frame.read()
            for issue in no_points(scan):
                warn(f"{path}: {issue.detail}")
            return facts_of_scan(scan, frame, card)


def _of_labels(path: Path) -> dict[str, Any]:
    labels, rest = divmod(path.stat().st_size, 4)
    if rest:
        raise InputError(path, "is not whole labels of 4 bytes", "Make the file again.")
    label = semantic(read_labels(path, labels))
    ids, counts = np.unique(label, return_counts=True)
    return {
        "points": len(label),
        "points by class id": dict(zip(map(str, ids), counts.tolist(), strict=True)),
    }


def _in_brief(facts: dict[str, Any]) -> dict[str, Any]:
    """The same with a model's candidates in words, and the record of its training as counts.

    That may name 2,000 scans.
    """
    match facts:
        case {"spec": {"training": dict(training)}}:
            counts = {kind: f"{len(names):,}" for kind, names in training.items()}
            candidates = candidates_at(
                Entry("model", "candidates", facts["spec"].get("candidates"))
            )
            brief = {"training": counts, "candidates": candidates or "every point"}
            return {**facts, "spec": {**facts["spec"], **brief}}
    return facts


def _indented(facts: Any, depth: int = 1) -> str:
    lines = []
    for name, fact in facts.items():
        if isinstance(fact, dict) and any(
            isinstance(value, dict | list) for value in fact.values()
        ):
            lines.append(f"{'  ' * depth}{name}:\n{_indented(fact, depth + 1)}")
        elif isinstance(fact, dict):
            inline = ", ".join(f"{key} {value}" for key, value in fact.items())
            lines.append(f"{'  ' * depth}{name}: {inline}")
        elif isinstance(fact, list) and fact and isinstance(fact[0], dict):
            lines.append(f"{'  ' * depth}{name}: {len(fact)}")
        else:
            lines.append(f"{'  ' * depth}{name}: {fact}")
    return "\n".join(lines)


# Letters of a line, as in every document of derain.
LINE_LENGTH = 100


def card_as_text(card: ModelCard, size: int) -> str:
    """A card in lines for the screen.

    Args:
        card: The card.
        size: Bytes of the model's file.
    """
    return "\n".join(
        [
            f"{card.title}, {size:,} bytes",
            *_part("what it is", card.what),
            *_part("when not to use it", *card.not_for),
            *_part("how good it is", *_scores(card.scores)),
            *_part("measured by", card.measured),
            *_part("threshold", f"{card.threshold:g}: {card.threshold_chosen}"),
            *_part("learnt from", card.data),
            *_part("made by", *card.training),
            *_part("seed", str(card.seed)),
            *_part("licence", card.licence),
            *_part("sha256", card.sha256),
        ]
    )


def _part(heading: str, *paragraphs: str) -> Iterator[str]:
    """A heading and what stands below it; of several paragraphs, further lines are set in."""
    yield f"  {heading}:"
    hanging = "    " if len(paragraphs) == 1 else "      "
    for paragraph in paragraphs:
        # As it is where it fits, for tables have columns.
        fits = len(paragraph) <= LINE_LENGTH - 4
        lines = [paragraph] if fits else wrap(paragraph, LINE_LENGTH - 6, break_long_words=False)
        yield f"    {lines[0]}"
        yield from (f"{hanging}{line}" for line in lines[1:])


def _scores(scores: Sequence[ModelScore]) -> list[str]:
    """A table of scores: a line of headings, and a line for each data set."""
    if not scores:
        return ["not measured"]
    width = max(len(score.data) for score in scores)
    return [
        f"{'':{width}}      P      R    IoU    taken",
        *(
            f"{score.data:{width}}  {number_text(score.precision):>5}"
            f"  {number_text(score.recall):>5}  {number_text(score.iou):>5}"
            f"  {number_text(score.taken, '.3%'):>7}"
            for score in scores
        ),
    ]
