"""``derain odometry``: finds where a sensor was, scan by scan, and writes its poses."""

import argparse
import math
import sys
from dataclasses import dataclass
from pathlib import Path

from tqdm import tqdm

from derain.bags.names import within
from derain.cli.arguments import add_threads
from derain.cli.outputs import ScanByScan, exit_code, print_facts, print_lines
from derain.cli.scan_options import add_columns, add_topic
from derain.errors import printable
from derain.recordings.registration import Registration
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.records import POSES
from derain.system.memory import keep_freed_memory
from derain.system.stopwatch import Stopwatch
from derain.workflows.odometry import find_poses

DESCRIPTION = """\
Registers each scan to the scan before it, and writes the poses of the sensor: one line per scan,
the transform of its points into the frame of the first scan.

  derain odometry drive --out poses.txt
  derain odometry drive --out drive/poses.txt               later commands read them there
  derain odometry drive --out drive.tum --format tum        time x y z qx qy qz qw
  derain odometry WADS --out poses                          poses/11.txt, poses/12.txt, ...
  derain odometry drive --out poses.txt --json

SEQUENCE is a folder of consecutive scans, or a data set, or a part of one. The residual is the
median distance between the surfaces of a scan and of the scan before it. derain warns of a scan
that it cannot register, with the reason. Its pose is then extrapolated at constant velocity, and
the exit code is 2.
"""


@dataclass(frozen=True)
class Registered:
    """What was found of one scan.

    Attributes:
        scan: Its file.
        metres: How far the sensor moved since the scan before.
        degrees: By how much it turned.
        residual: Median distance from the surfaces of the scan before, metres; None if unknown.
        matched: Share of its surfaces that the scan before has too.
        trusted: Whether that is to be believed.
        reason: Why not.
        milliseconds: By stage.
    """

    scan: str
    metres: float
    degrees: float
    residual: float | None
    matched: float
    trusted: bool
    reason: str
    milliseconds: dict[str, float]

    def __str__(self) -> str:
        apart = "none" if self.residual is None else f"{self.residual:.3f} m"
        told = "" if self.trusted else ", NOT TRUSTED"
        return (
            f"{printable(self.scan)}: {self.metres:.2f} m, {self.degrees:.2f} deg, residual "
            f"{apart}, {self.matched:.0%} matched, {sum(self.milliseconds.values()):.0f} ms{told}"
        )


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "sequences", nargs="+", type=Path, metavar="SEQUENCE", help="folders of consecutive scans"
    )
    parser.add_argument(
        "--out",
        type=Path,
        required=True,
        help="file to write; for several sequences, folder of files <sequence>.txt",
    )
    parser.add_argument(
        "--format",
        choices=("kitti", "tum"),
        default="kitti",
        help="format of a line: the twelve numbers of a matrix (kitti), or time, position and "
        "quaternion (tum; the scans need times) (default: %(default)s)",
    )
    parser.add_argument(
        "--replace", action="store_true", help=f"replace a {POSES} that belongs to the scans"
    )
    parser.add_argument("--json", action="store_true", help="print one JSON object per scan")
    add_threads(parser)
    add_columns(parser)
    add_topic(parser)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    keep_freed_memory()
    source = named_frames(within(arguments.sequences, arguments.topic), arguments.columns)
    scans = ScanByScan(source)

    def show(frame: Frame, registration: Registration, stopwatch: Stopwatch) -> None:
        print_facts(_registered(frame, registration, stopwatch), arguments.json)

    recordings = find_poses(
        source,
        arguments.out,
        form=arguments.format,
        replace=arguments.replace,
        threads=arguments.threads,
        guard=scans.skipping_failures,
        watch=show,
    )
    for found in recordings:
        if found.fault is None:
            print_lines(str(found), sys.stderr if arguments.json else None)
        else:
            tqdm.write(f"derain: {found.fault}", sys.stderr)
    untrusted = sum(found.untrusted for found in recordings)
    return exit_code(untrusted, len(source), "{scans} could not be registered")


def _registered(frame: Frame, registration: Registration, stopwatch: Stopwatch) -> Registered:
    return Registered(
        frame.name,
        registration.distance,
        registration.turn,
        None if math.isnan(registration.residual) else registration.residual,
        registration.matched,
        registration.trusted,
        registration.reason,
        dict(stopwatch.milliseconds),
    )
