"""``derain view``: scans as several methods clean them, in a picture, a window or over time."""

import argparse
from pathlib import Path

from derain.bags.names import is_bag
from derain.cli.arguments import add_threads, count, whole
from derain.cli.bag_options import add_topic
from derain.cli.filter_help import list_methods
from derain.cli.pose_options import add_poses
from derain.cli.scan_options import add_columns, add_intensity_scale
from derain.default import DEFAULT
from derain.errors import InputError

DESCRIPTION = """\
Draws a scan, its labels if there are any, and the result of each method, from above and from the
sensor; or writes a recording for Rerun's viewer.

  derain view scan.bin --out figure.png
  derain view scan.bin --methods default outdet.onnx dsor --out figure.png
  derain view scan.bin --card wads --methods outdet.onnx tuned=dsor.yaml dror --out figure.png
  derain view scan.bin --methods outdet.onnx --window
  derain view recording/ --methods default dsor --rerun out.rrd    then: rerun out.rrd
  derain view recording/ --card wads --every 10 --rerun out.rrd
  derain view recording/ --methods persistence --poses odometry --frames 0:50 --rerun out.rrd
  derain view drive.mcap/velodyne_points/000012 --out figure.png

A method is a model (.onnx), parameters from `derain tune` (.yaml), default or a filter (below); for
one scan also all or none, for a recording also a method that sees several scans. --card gives the
meaning of the labels, which are ignored without it. With it, pictures leave out points labelled as
unknown.
derain draws the first cloud of a bag, unless the path names another.
It needs derain[view]; --window also needs derain[scene].
--rerun writes the scans; for each method the points that it keeps and removes, and their
probability of rain; range images; the share of removed points over time, and with --card the IoU of
each scan. It first prints the expected size. With poses, from beside the scans or from --poses, the
scans are placed in the world. It reports scans that it cannot read or judge, and shows them empty;
the exit code is then 2.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
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
    parser.add_argument("--out", type=Path, help="PNG file to write")
    parser.add_argument("--window", action="store_true", help="open a window for each method")
    parser.add_argument(
        "--rerun", type=Path, metavar="FILE", help="Rerun file to write (.rrd), for a recording"
    )
    parser.add_argument(
        "--frames",
        type=_numbers,
        default=slice(None),
        metavar="FROM:TO",
        help="with --rerun, show scans FROM to TO - 1, counted from 0 (default: all)",
    )
    parser.add_argument(
        "--every", type=count, default=1, help="with --rerun, show every n-th scan (default: 1)"
    )
    parser.add_argument(
        "--card", help="data card of the scans' labels (beside them or in ../labels), such as wads"
    )
    add_columns(parser)
    add_intensity_scale(parser)
    add_threads(parser)
    add_poses(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    if arguments.rerun is not None:
        from derain.cli.view_recording import view_recording

        if arguments.out or arguments.window:
            raise InputError(
                "--rerun", "a recording is shown in no picture", "Leave out --out and --window."
            )
        return view_recording(arguments)
    from derain.cli.view_scan import view_scan

    path = arguments.scans[0]
    if len(arguments.scans) > 1 or (path.is_dir() and not is_bag(path)):
        raise InputError(
            path,
            "is more than one scan, which no picture shows",
            "Name one, or give --rerun out.rrd to look at all of them.",
        )
    view_scan(arguments)
    return 0


def _numbers(text: str) -> slice:
    """Places of scans, such as ``10:20``, ``10:`` or ``:20``."""
    first, colon, end = text.partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"{text} is not FROM:TO, such as 10:20")
    return slice(*(whole(part) if part else None for part in (first, end)))
