"""``derain odometry``: finds where a sensor was, scan by scan, and writes its poses."""

import argparse
import math
import sys
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import pairwise
from pathlib import Path
from statistics import median

import numpy as np
from tqdm import tqdm

from derain.bags.names import within
from derain.cli.arguments import add_threads
from derain.cli.bag_options import add_topic
from derain.cli.outputs import say, tell
from derain.cli.pose_files import files_of, tell_whose_poses
from derain.cli.scan_by_scan import ScanByScan, exit_code
from derain.cli.scan_options import add_columns
from derain.errors import InputError, printable
from derain.odometry.recordings import FrameOdometry
from derain.odometry.registration import Registration
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.sources.records import POSES
from derain.sources.trajectory import Trajectory, write_trajectory
from derain.system.memory import keep_freed_memory
from derain.system.notices import warn
from derain.system.stopwatch import Stopwatch

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
    recordings = recordings_of(source)
    files = files_of(recordings, arguments.out, arguments.replace)
    times = [_times(recording, arguments.format) for recording in recordings]
    if arguments.format == "kitti":
        tell_whose_poses(files, recordings)
    scans, odometry = ScanByScan(source), FrameOdometry(arguments.threads)
    found = [_register(frame, scans, odometry, arguments.json) for frame in scans]
    untrusted = sum(not registration.trusted for registration in found)
    for recording, file, seconds in zip(recordings, files, times, strict=True):
        of_recording, found = found[: len(recording)], found[len(recording) :]
        try:
            _write(file, of_recording, seconds if arguments.format == "tum" else None)
        except InputError as error:  # the other recordings are none the worse for it
            tqdm.write(f"derain: {error}", sys.stderr)
            continue
        summary = _summary(file, of_recording, recording, seconds)
        say(summary, sys.stderr if arguments.json else None)
    return exit_code(untrusted, len(source), "{scans} could not be registered")


def _register(
    frame: Frame, scans: ScanByScan, odometry: FrameOdometry, as_json: bool
) -> Registration:
    """Registers one scan, and tells what was found."""
    stopwatch, scan = Stopwatch(), None
    with scans.passing_over(frame), stopwatch.stage("read"):
        scan = frame.read()
    with stopwatch.stage("register"):
        registration = odometry.take(frame, scan)
    if scan is not None and not registration.trusted:
        warn(f"{frame.name}: not to be trusted: {registration.reason}")
    residual = None if math.isnan(registration.residual) else registration.residual
    facts = Registered(
        frame.name,
        registration.distance,
        registration.turn,
        residual,
        registration.matched,
        registration.trusted,
        registration.reason,
        dict(stopwatch.milliseconds),
    )
    tell(facts, as_json)
    return registration


def _write(
    file: Path, registrations: Sequence[Registration], times: Sequence[float] | None
) -> None:
    """Writes the poses of a recording, unless nothing is known of them."""
    if len(registrations) > 1 and not any(each.trusted for each in registrations[1:]):
        raise InputError(
            file,
            "was not written: no two scans of the recording could be laid upon one another "
            f"({registrations[1].reason})",
            "See that they are consecutive, in order of time, and of one sensor.",
        )
    poses = np.array([each.pose for each in registrations])
    write_trajectory(file, Trajectory(poses, None if times is None else np.array(times)))


def _summary(
    file: Path,
    registrations: Sequence[Registration],
    recording: Sequence[Frame],
    times: Sequence[float],
) -> str:
    """What was found of a whole recording."""
    if len(registrations) == 1:
        return f"{file}: 1 scan alone tells of no motion: its pose is the identity"
    moves = registrations[1:]
    path = sum(each.distance for each in moves)
    lasted = times[-1] - times[0] if times else 0.0
    speed = f", {path / lasted:.1f} m/s" if lasted > 0 else ""
    residuals = [
        (each.residual, frame.key)
        for each, frame in zip(moves, recording[1:], strict=True)
        if not math.isnan(each.residual)
    ]
    worst, of_scan = max(residuals, default=(math.nan, "none"))
    usual = median([residual for residual, _ in residuals] or [math.nan])
    failed = sum(not each.trusted for each in registrations)
    return (
        f"{file}: {len(registrations):,} scans, path {path:.1f} m, {path / len(moves):.2f} m a scan"
        f"{speed}; residual median {usual:.3f} m, worst {worst:.3f} m "
        f"({of_scan}); {failed:,} not to be trusted"
    )


def _times(recording: Sequence[Frame], form: str) -> list[float]:
    """When the scans of a recording were taken, seconds; empty where not all of it is known."""
    times = [time for frame in recording if (time := frame.time) is not None]
    if len(times) == len(recording):
        if form == "tum":
            _refuse_times_that_turn_back(times, recording)
        return times
    if form == "tum":
        lacking = next(frame for frame in recording if frame.time is None)
        raise InputError(
            lacking.name,
            "nothing says when it was taken, and a line of TUM's form begins with the time",
            "Write a times.txt beside the scans, a line of seconds each, or take --format kitti.",
        )
    return []


def _refuse_times_that_turn_back(times: Sequence[float], recording: Sequence[Frame]) -> None:
    """Refuses times by which poses could not be found again: they have to ascend."""
    for (earlier, later), frame in zip(pairwise(times), recording[1:], strict=True):
        if later <= earlier:
            raise InputError(
                frame.name,
                f"was taken at {later:.3f} s, the scan before it at {earlier:.3f} s, and lines of "
                "TUM's form go by ascending time",
                "Name the scans in the order that they were taken in, or take --format kitti.",
            )
