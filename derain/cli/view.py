"""``derain view``: one scan as several methods clean it."""

import argparse
from pathlib import Path
from typing import TYPE_CHECKING

from derain.cards.card import DataCard, load_card
from derain.cards.known import layouts_for
from derain.cli.arguments import add_threads
from derain.cli.bag_options import add_topic, in_topic
from derain.cli.filter_help import list_filters
from derain.cli.outputs import say
from derain.cli.scan_options import add_columns, add_intensity_scale
from derain.default import DEFAULT
from derain.errors import InputError
from derain.sources.folders import frame_of
from derain.system.notices import Notices
from derain.views.oddities import outside_view

if TYPE_CHECKING:
    import numpy as np
    from numpy.typing import NDArray

    from derain.export.bench.contestant import Contestant
    from derain.scan import Scan
    from derain.sources.frame import Frame

SUMMARY = "draw a scan as several methods clean it"

DESCRIPTION = """\
Draws a scan, its truth where it has labels, and what each method makes of it, from above and as the
sensor sees it.

  derain view scan.bin --out figure.png
  derain view scan.bin --methods default outdet.onnx dsor --out figure.png
  derain view scan.bin --card wads --methods outdet.onnx tuned=dsor.yaml dror --out figure.png
  derain view scan.bin --methods outdet.onnx --window
  derain view drive.mcap/velodyne_points/000012 --out figure.png

A method is a model (.onnx), parameters that `derain tune` wrote (.yaml), default or a filter
(below), all or none. --card says what the scan's labels mean; without it there is no truth, and
with it points whose label says that they are unknown are left out.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("scan", type=Path)
    list_filters(parser)
    parser.add_argument(
        "--methods",
        nargs="+",
        default=[DEFAULT],
        metavar="[TITLE=]METHOD",
        help="(default: default, the model that comes with derain)",
    )
    parser.add_argument("--out", type=Path, help="PNG file to write")
    parser.add_argument("--window", action="store_true", help="open a window for each method")
    parser.add_argument(
        "--card", help="data card of the scan's labels (beside it or in ../labels), such as wads"
    )
    add_columns(parser)
    add_intensity_scale(parser)
    add_threads(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.export.bench.contestants import contestants

    if not (arguments.out or arguments.window):
        raise InputError(arguments.scan, "nothing is to be done with it", "Give --out or --window.")
    methods = contestants(arguments.methods)
    card = None if arguments.card is None else load_card(arguments.card)
    path = in_topic([arguments.scan], arguments)[0]
    frame = frame_of(path, arguments.columns, layouts_for(card))
    scan = frame.with_intensity_times(arguments.intensity_scale).read()
    notices = Notices()
    for method in methods:
        if method.judges_by is not None:
            notices.tell(frame.name, method.judges_by.oddities(scan), method.title)
    truth = None if card is None else _truth(scan, frame, card)
    predicted = {
        method.title: _rain(scan, method, arguments.threads, notices) for method in methods
    }
    title, rain = f"{arguments.scan.name}: {len(scan):,} points", None
    if truth is not None:
        rain, known = truth
        scan, rain = scan.take(known), rain[known]
        predicted = {name: called_rain[known] for name, called_rain in predicted.items()}
    if arguments.out:
        from derain.pictures.comparison import comparison_figure
        from derain.pictures.scan_pictures import save

        save(comparison_figure(scan, predicted, rain, title), arguments.out)
        say(str(arguments.out))
    if arguments.window:
        from derain.pictures.comparison_window import show_comparison

        show_comparison(scan, predicted, rain)
    return 0


def _rain(
    scan: "Scan", method: "Contestant", threads: int, notices: Notices
) -> "NDArray[np.bool_]":
    """Which points a method calls rain, bool (N,); warns where a model cannot see much of them."""
    from derain.export.runtime import Derainer
    from derain.system.stopwatch import Stopwatch

    judge = method.ready(threads)
    if not isinstance(judge, Derainer):
        return judge(scan, Stopwatch())
    judgement = judge.judge(scan)
    outside = outside_view(scan, judgement.judged, judge.spec.data)
    notices.tell(scan.name, outside, method.title)
    return judgement.rain


def _truth(
    scan: "Scan", frame: "Frame", card: DataCard
) -> "tuple[NDArray[np.bool_], NDArray[np.bool_]]":
    """Which points are rain, and of which it is known."""
    labelled = scan.with_label(frame.read_label(len(scan)))
    return card.rain_of(labelled), ~card.unknown_of(labelled)
