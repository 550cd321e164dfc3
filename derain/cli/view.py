"""``derain view``: shows scans as several methods clean them."""

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

A method is a model (.onnx), parameters written by `derain tune` (.yaml), default or a filter
(below); for one scan also all or none, for a recording also methods of several scans. --card names
the data card of the labels; without it no truth is shown. Pictures leave out points whose label is
unknown.
Of a bag, the first cloud is drawn unless the path names another.
It needs derain[view]; --window also needs derain[scene].
--rerun writes the scans, and for each method the points it keeps, the points it removes and the
probability of rain; range images; the share removed from each scan, and with --card its IoU. With
poses, from files beside the scans or by --poses, the scans are placed in the world. Scans that
cannot be read or judged are reported and shown empty; the exit code is then 2.
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
        help="with --rerun, show only scans FROM up to but not including TO, from 0 (default: all)",
    )
    parser.add_argument(
        "--every",
        type=count,
        default=1,
        metavar="N",
        help="with --rerun, show every Nth scan (default: 1)",
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
            raise InputError("--rerun", "excludes --out and --window", "Leave them out.")
        return view_recording(arguments)
    from derain.cli.view_scan import view_scan

    path = arguments.scans[0]
    if len(arguments.scans) > 1 or (path.is_dir() and not is_bag(path)):
        raise InputError(
            path,
            "is more than one scan; a picture shows one",
            "Name one, or give --rerun out.rrd to see all of them.",
        )
    view_scan(arguments)
    return 0


def _numbers(text: str) -> slice:
    """Places of scans, such as ``10:20``, ``10:`` or ``:20``."""
    first, colon, end = text.partition(":")
    if not colon:
        raise argparse.ArgumentTypeError(f"{text} is not FROM:TO, such as 10:20")
    return slice(*(whole(part) if part else None for part in (first, end)))
