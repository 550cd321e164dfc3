"""``derain info``: what is in a scan, a label file, a model or a data set."""

import argparse
import json
import os
import sys
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from derain.bags.names import is_bag, split, within
from derain.cards.card import load_card
from derain.cards.known import layouts_for
from derain.cli.bag_options import add_topic
from derain.cli.info_bag import facts_of_bag
from derain.cli.info_default import card_as_text
from derain.cli.info_folder import draw, facts_of_folder
from derain.cli.info_returns import facts_of_returns
from derain.cli.outputs import print_lines
from derain.cli.scan_options import ListFormats, add_columns
from derain.default import DEFAULT, default_model, model_card
from derain.errors import InputError, printable
from derain.files.documents import Entry
from derain.files.labels import read_labels, semantic
from derain.files.reading import reading
from derain.scan import Scan
from derain.sources.folders import frame_of, named_frames
from derain.system.extras import CHECKPOINT_LIBRARIES, MATPLOTLIB, require
from derain.system.notices import warn
from derain.views.candidates import candidates_at
from derain.views.directions import directions
from derain.views.grid_fit import fit_grid
from derain.views.morton import distinct_rows
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
    _refuse_unclear_picture(arguments)
    if arguments.grid:
        paths = within([Path(name) for name in arguments.files], arguments.topic)
        frames = named_frames(paths, arguments.columns)
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
    if name == DEFAULT:  # ./default is another thing, and a Path would not tell them apart
        _describe_default(arguments)
        return
    path = within([Path(name)], arguments.topic)[0]
    if os.path.isdir(path) and not is_bag(path):
        _describe_folder(path, arguments)
        return
    facts = _facts(path, arguments)
    if arguments.json:
        print(json.dumps({"file": str(path), **facts}))
    else:
        print(printable(str(path)))
        print_lines(_indented(_in_brief(facts)))


def _refuse_unclear_picture(arguments: argparse.Namespace) -> None:
    """Refuses a picture of anything but the statistics of one folder."""
    if arguments.picture and (
        arguments.grid or len(arguments.files) > 1 or not os.path.isdir(arguments.files[0])
    ):
        raise InputError("--picture", "shows one folder's statistics", "Name one folder alone.")
    if arguments.picture:
        require("--picture", MATPLOTLIB)


def _describe_default(arguments: argparse.Namespace) -> None:
    """Prints the card of the model that comes with derain, once its file is known to be it."""
    if os.path.exists(DEFAULT):
        raise InputError(
            DEFAULT,
            "it is the model that comes with derain, and something here is called so too",
            f"Write ./{DEFAULT} for that, or ask from another folder.",
        )
    model, card = default_model(), model_card()
    if arguments.json:
        print(json.dumps({"file": str(model), **card.as_dict()}))
    else:
        print_lines(card_as_text(card, model.stat().st_size))


def _describe_folder(folder: Path, arguments: argparse.Namespace) -> None:
    facts = facts_of_folder(folder, arguments)
    print_lines(json.dumps(facts.as_dict()) if arguments.json else facts.as_text())
    if arguments.card is not None and not facts.total.labelled:
        warn(
            f"{folder}: no labels are beside its scans or in a folder that the card names. Name "
            f"the folders of scans and labels, as in --layout {folder.absolute().name},labels"
        )
    if arguments.picture:
        draw(facts, arguments.picture)


def _facts(path: Path, arguments: argparse.Namespace) -> dict[str, Any]:
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
            card = None if arguments.card is None else load_card(arguments.card)
            frame = frame_of(path, arguments.columns, layouts_for(card))
            scan = frame.read()
            for issue in no_points(scan):
                warn(f"{path}: {issue.detail}")
            return {**_of_scan(scan), "returns": facts_of_returns(scan, frame, card)}


def _of_scan(scan: Scan) -> dict[str, Any]:
    valid = scan.valid
    points = scan.xyz[valid]
    azimuth, inclination = directions(points)
    return {
        "points": len(scan),
        "valid": int(valid.sum()),
        "distinct positions": len(distinct_rows(scan)[0]),
        "organised": "no" if scan.shape is None else f"{scan.shape[0]} x {scan.shape[1]}",
        "fields": {name: str(column.dtype) for name, column in scan.fields.items()},
        "x / m": _span(points[:, 0]),
        "y / m": _span(points[:, 1]),
        "z / m": _span(points[:, 2]),
        "range / m": _span(scan.range[valid]),
        "azimuth / deg": _span(azimuth),
        "inclination / deg": _span(inclination),
        "intensity": "none" if scan.intensity is None else _span(scan.intensity[valid]),
        "fitted grid": _fitted(scan) if valid.any() else "none",
    }


def _fitted(scan: Scan) -> dict[str, Any]:
    fit = fit_grid([scan]).as_dict()
    del fit["grid"]  # one number a row: of use in a configuration, for which there is --grid
    return fit


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


def _span(values: NDArray[Any]) -> dict[str, float] | str:
    if not len(values):
        return "none"
    lowest, median, highest = np.percentile(values, [0, 50, 100])
    return {
        "min": round(float(lowest), 4),
        "median": round(float(median), 4),
        "max": round(float(highest), 4),
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
