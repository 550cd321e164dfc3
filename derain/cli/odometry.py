"""Registers each scan to the scan before it, and writes the poses of the sensor.

A line per scan holds the transform of its points into the frame of the first scan, as twelve
numbers (KITTI's format).

  derain odometry drive --out drive/poses.txt               later commands read them there
  derain odometry drive --out drive.txt                     for --poses drive.txt
  derain odometry WADS --out poses                          poses/11.txt, poses/12.txt, ...

SEQUENCE is a folder of consecutive scans, or a data set, or a part of one. The residual is the
median distance between the surfaces of a scan and of the scan before it. derain warns of a scan
that it cannot register, with the reason. Its pose is then extrapolated at constant velocity, and
the exit code is 2.
"""

import argparse
import math
from pathlib import Path

from derain.cli.options import add_columns, add_threads, add_topic
from derain.cli.outputs import exit_code, print_error, print_line, print_lines
from derain.recordings.odometry import Registration
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.judging import Failures
from derain.stores.url import place_of
from derain.system.stopwatch import Stopwatch
from derain.workflows.odometry import find_poses


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "sequences",
        nargs="+",
        type=place_of,
        metavar="SEQUENCE",
        help="folders of consecutive scans",
    )
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="file to write; for several sequences, folder of files <sequence>.txt",
    )
    parser.add_argument("--replace", action="store_true", help="replace a file that exists")
    add_threads(parser)
    add_columns(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    source = named_frames(arguments.sequences, arguments.columns, topic=arguments.topic)
    recordings = find_poses(
        source,
        arguments.out,
        replace=arguments.replace,
        threads=arguments.threads,
        guard=Failures(print_error).skipping_failures,
        watch=_print_registration,
    )
    for found in recordings:
        if found.fault is None:
            print_lines(str(found))
        else:
            print_error(found.fault)
    untrusted = sum(found.untrusted for found in recordings)
    code = exit_code(untrusted, len(source), "{scans} could not be registered")
    return 2 if any(found.fault for found in recordings) else code


def _print_registration(frame: Frame, found: Registration, stopwatch: Stopwatch) -> None:
    residual = "none" if math.isnan(found.residual) else f"{found.residual:.3f} m"
    text = (
        f"{frame.name}: {found.distance:.2f} m, {found.turn:.2f} deg, residual {residual}, "
        f"{found.matched:.0%} matched, {sum(stopwatch.milliseconds.values()):.0f} ms"
    )
    print_line(text if found.trusted else f"{text}, NOT TRUSTED")
