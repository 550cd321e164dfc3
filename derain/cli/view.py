"""Shows scans as several methods clean them.

Draws a scan, its labels if there are any, and the result of each method, from above and from the
sensor; or writes a recording for Rerun's viewer.

  derain view scan.bin --out figure.png
  derain view scan.bin --methods default outdet.onnx dsor --out figure.png
  derain view scan.bin --card wads --methods outdet.onnx tuned=dsor.yaml dror --out figure.png
  derain view scan.bin --methods outdet.onnx --window
  derain view recording/ --methods default dsor --rerun out.rrd    then: rerun out.rrd
  derain view recording/ --card wads --frames ::10 --rerun out.rrd
  derain view recording/ --methods persistence --poses poses.txt --frames 0:50 --rerun out.rrd
  derain view drive.mcap/velodyne_points/000012 --out figure.png

A method is a model (.onnx), parameters written by `derain tune` (.yaml), default or a filter
(below); for one scan also all or none, for a recording also methods of several scans. --card names
the data card of the labels; without it no truth is shown. Pictures leave out points whose label is
unknown.
Of a bag, the first cloud is drawn unless the path names another.
It needs derain[view]; --window also needs derain[scene].
--rerun writes the scans and their range images, and for each method the points it keeps, the points
it removes, the probability of rain, and the share removed from each scan. With poses, from files
beside the scans or by --poses, the scans are placed in the world. Scans that cannot be read or
judged are reported and shown empty; the exit code is then 2.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np

from derain.bags.names import in_bag, is_bag
from derain.cards.card import load_card
from derain.cards.known import layouts_for
from derain.cli import options
from derain.cli.method_options import list_methods
from derain.cli.outputs import print_lines
from derain.cli.parser import Parser, whole
from derain.cli.playback import refuse_unusable, write_and_report
from derain.default import DEFAULT
from derain.errors import InputError
from derain.example import example_file, or_example
from derain.export import methods
from derain.recordings.posed import with_poses
from derain.sources.bag_frame import NUMBER, BagFrame
from derain.sources.folders import frame_of, named_frames
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.sources.recordings import irregularities
from derain.stores.url import paths_of
from derain.system.extras import MATPLOTLIB, OPEN3D, require
from derain.system.notices import Notices, warn


def add_arguments(parser: Parser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "scans", nargs="+", type=Path, metavar="SCAN", help="scan; with --rerun, recordings"
    )
    list_methods(parser)
    parser.add_argument(
        "--methods",
        nargs="+",
        default=[DEFAULT],
        metavar="[TITLE=]METHOD",
        help="methods to compare (default: default, the model that comes with derain)",
    )
    parser.add_argument("--out", type=options.picture, help="picture to write, such as .png")
    parser.add_argument("--window", action="store_true", help="open a window for each method")
    parser.add_argument(
        "--rerun", type=Path, metavar="FILE", help="Rerun file to write (.rrd), for a recording"
    )
    parser.add_argument(
        "--frames",
        type=_numbers,
        default=slice(None),
        metavar="FROM:TO[:STEP]",
        help="with --rerun, show only scans FROM up to but not including TO, from 0, or one in "
        "STEP of them (default: all)",
    )
    parser.add_argument(
        "--card", help="data card of the scans' labels (beside them or in ../labels), such as wads"
    )
    options.add_columns(parser)
    options.add_intensity_scale(parser)
    options.add_threads(parser)
    options.add_poses(parser)
    options.add_topic(parser)


def _numbers(text: str) -> slice:
    """Places of scans, such as ``10:20``, ``10:`` or ``::5``."""
    parts = [whole(part) if part else None for part in text.split(":")]
    if len(parts) not in (2, 3) or any(step is not None and step < 1 for step in parts[2:]):
        raise argparse.ArgumentTypeError(f"{text} is not FROM:TO[:STEP], such as 10:20 or ::5")
    return slice(*parts)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    if arguments.rerun is not None:
        if arguments.out or arguments.window:
            reason = "cannot be combined with --out or --window"
            raise InputError("--rerun", reason, "Leave them out.")
        return _view_recording(arguments)
    path = paths_of(arguments.scans)[0]
    if or_example(path) != path:
        path = example_file()
    if len(arguments.scans) > 1 or (path.is_dir() and not is_bag(path)):
        reason = "a picture shows one scan, and neither a folder nor several"
        raise InputError(path, reason, "Name one scan, or give --rerun out.rrd to see all of them.")
    if not (arguments.out or arguments.window):
        raise InputError(path, "no output is named", "Give --out, --window or --rerun.")
    require("view", MATPLOTLIB, *((OPEN3D,) if arguments.window else ()))
    _view_scan(in_bag(path, arguments.topic), arguments)
    return 0


def _view_recording(arguments: argparse.Namespace) -> int:
    """Writes a recording as several methods clean it, for Rerun's viewer."""
    refuse_unusable(arguments.rerun)
    compared = {
        title: methods.load_method(*methods.named_method(name), arguments.threads)
        for title, name in _names_by_title(arguments.methods).items()
    }
    card = None if arguments.card is None else load_card(arguments.card)
    found = named_frames(
        arguments.scans,
        arguments.columns,
        labelled=card is not None,
        layouts=layouts_for(card),
        recordings=True,
        topic=arguments.topic,
    )
    source = with_poses(found, arguments.poses).map(
        lambda frame: frame.with_intensity_times(arguments.intensity_scale)
    )
    from derain.pictures.selection import Labels, Selection

    selection = Selection(source, range(len(source))[arguments.frames])
    if card is not None and not any(frame.has_labels for frame in selection.frames):
        warn(f"{selection.frames[0].name}: no scan has labels, so no truth is shown")
        card = None
    for method in compared.values():
        for sentence in irregularities(source, method.window):
            warn(sentence)
    labels = None if card is None else Labels(card)
    return write_and_report(arguments.rerun, selection, compared, labels)


def _names_by_title(words: Sequence[str]) -> dict[str, str]:
    """Names or files of methods by their titles, in the order of the words of ``--methods``.

    Raises:
        InputError: Two methods of one title.
    """
    named = [methods.split_title(text) for text in words]
    methods.refuse_same_titles([title for title, _ in named])
    return dict(named)


def _view_scan(path: Path, arguments: argparse.Namespace) -> None:
    """Draws a scan as several methods clean it, or shows it in a window."""
    names = _names_by_title(arguments.methods)
    card = None if arguments.card is None else load_card(arguments.card)
    frame = frame_of(path, arguments.columns, layouts_for(card))
    scan = frame.with_intensity_times(arguments.intensity_scale).read()
    labelled = None if card is None else FrameReader(card).with_labels(scan, frame)
    trivial = {"all": np.ones(len(scan), bool), "none": np.zeros(len(scan), bool)}
    notices, predicted = Notices(), {}
    for title, name in names.items():
        if name in trivial:
            predicted[title] = trivial[name]
            continue
        method = methods.load_method_of_one_scan(*methods.named_method(name), arguments.threads)
        judgement = method.judge(scan)
        notices.warn(frame.name, method.issues(judgement), title)
        predicted[title] = judgement.rain
    title, rain = f"{_name_in_title(frame, path)}: {len(scan):,} points", None
    if card is not None and labelled is not None:
        known = ~card.unknown_of(labelled)
        rain = card.rain_of(labelled)[known]
        scan = scan.take(known)
        predicted = {name: called_rain[known] for name, called_rain in predicted.items()}
    from derain.pictures.scan_pictures import comparison_figure, save, show_comparison

    if arguments.out:
        save(comparison_figure(scan, predicted, rain, title), arguments.out)
        print_lines(str(arguments.out))
    if arguments.window:
        show_comparison(scan, predicted, rain)


def _name_in_title(frame: Frame, path: Path) -> str:
    """Name of a scan in the title; prints which cloud of a bag is drawn."""
    if not isinstance(frame, BagFrame):
        return path.name
    if NUMBER.fullmatch(path.name) is None:
        print_lines(f"{frame.name} is drawn, the first of {len(frame.clouds):,} clouds")
    return str(frame.path.relative_to(frame.clouds.bag.path.parent))
