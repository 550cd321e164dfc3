"""Finds where a sensor was, scan by scan, and writes its poses."""

import math
import os
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from dataclasses import replace as replaced
from itertools import pairwise
from pathlib import Path
from statistics import median
from typing import Literal

import numpy as np
from tqdm import tqdm

from derain.cards.layout import folder_above
from derain.errors import InputError
from derain.files import RECORDS
from derain.files.atomic import require_writable
from derain.files.reading import is_file
from derain.recordings.odometry import FrameOdometry, Registration
from derain.recordings.posed import ODOMETRY, with_odometry, with_poses
from derain.sources.frame import Frame, times_of
from derain.sources.judging import Guard, unguarded
from derain.sources.recordings import recordings_of
from derain.sources.records import POSES
from derain.sources.source import Frames, Source
from derain.sources.trajectory import Trajectory, write_trajectory
from derain.system.notices import Notices, warn
from derain.system.stopwatch import Stopwatch

# Receives the registration of each scan as soon as it is found, and the times of its stages.
Watch = Callable[[Frame, Registration, Stopwatch], None]

PoseFormat = Literal["kitti", "tum"]


@dataclass(frozen=True)
class FoundPoses:
    """The poses of one recording; as text, a summary in one line.

    Attributes:
        file: The file or folder to write to.
        frames: The scans, in time order.
        registrations: Registration of each scan.
        times: Times of the scans, seconds; empty unless all are known.
        fault: Why the file could not be written; None where it is.
    """

    file: Path
    frames: Sequence[Frame]
    registrations: Sequence[Registration]
    times: Sequence[float]
    fault: InputError | None = None

    @property
    def untrusted(self) -> int:
        """Number of scans that could not be registered."""
        return sum(not each.trusted for each in self.registrations)

    def __str__(self) -> str:
        if len(self.registrations) == 1:
            return f"{self.file}: 1 scan shows no motion: its pose is the identity"
        moves = self.registrations[1:]
        path = sum(each.distance for each in moves)
        lasted = self.times[-1] - self.times[0] if self.times else 0.0
        speed = f", {path / lasted:.1f} m/s" if lasted > 0 else ""
        residuals = [
            (each.residual, frame.key)
            for each, frame in zip(moves, self.frames[1:], strict=True)
            if not math.isnan(each.residual)
        ]
        worst, of_scan = max(residuals, default=(math.nan, "none"))
        usual = median([residual for residual, _ in residuals] or [math.nan])
        return (
            f"{self.file}: {len(self.registrations):,} scans, path {path:.1f} m, "
            f"{path / len(moves):.2f} m a scan{speed}; residual median {usual:.3f} m, worst "
            f"{worst:.3f} m ({of_scan}); {self.untrusted:,} not to be trusted"
        )


def find_poses(
    source: Source,
    out: Path,
    *,
    form: PoseFormat = "kitti",
    replace: bool = False,
    threads: int = 0,
    guard: Guard = unguarded,
    watch: Watch = lambda frame, registration, stopwatch: None,
) -> list[FoundPoses]:
    """Registers every scan with the one before it, and writes the poses of each recording.

    Args:
        source: Scans of one recording or more, in time order.
        out: The file of the only recording; of several, a folder with ``<sequence>.txt`` for each.
        form: Format of a line of a file: ``kitti``, twelve numbers of a matrix, or ``tum``, time,
            position and quaternion.
        replace: True if poses that came with the scans may be replaced.
        threads: Threads to use; 0 takes every core.
        guard: Surrounds the reading of each scan; one whose error it holds back is not trusted.
        watch: Receives each registration.

    Returns:
        The poses of each recording, in the order of the source.

    Raises:
        InputError: A file that cannot be written, that came with the scans, or that two recordings
            would share; times that are missing or do not ascend, for ``tum``; a scan that cannot
            be read, where the guard lets that through.
    """
    recordings = recordings_of(source)
    files = _files_of(recordings, out, replace)
    times = [_times(recording, form) for recording in recordings]
    odometry = FrameOdometry(threads)
    found = []
    with tqdm(total=len(source), desc=ODOMETRY, unit="scan", disable=None) as bar:
        for file, recording, seconds in zip(files, recordings, times, strict=True):
            registrations = []
            for frame in recording:
                registrations.append(_register(frame, odometry, guard, watch))
                bar.update()
            poses = FoundPoses(file, recording, registrations, seconds)
            try:
                _write(poses, form)
            except InputError as error:  # the other recordings go on
                poses = replaced(poses, fault=error)
            found.append(poses)
    return found


def placed(source: Source, poses: str | None, threads: int = 0) -> Source:
    """The same frames with poses; warns of scans that odometry cannot register.

    Args:
        source: The frames.
        poses: As :func:`derain.recordings.posed.with_poses` takes it, or ``odometry``. None leaves
            the frames as they are: a method that needs poses takes those beside the scans, or finds
            them itself.
        threads: Threads of odometry; 0 takes every core.

    Raises:
        InputError: Poses that cannot be read or do not fit the scans.
    """
    if poses is None:
        return source
    if poses != ODOMETRY:
        return with_poses(source, poses)
    notices = Notices()
    posed: list[Frame] = []
    registered = with_odometry(source, threads)
    bar = tqdm(registered, total=len(source), desc=ODOMETRY, unit="scan", disable=None)
    for frame, issues in bar:
        notices.warn(frame.name, issues)
        posed.append(frame)
    notices.warn_of_repeats()
    return Frames(posed)


def _register(frame: Frame, odometry: FrameOdometry, guard: Guard, watch: Watch) -> Registration:
    stopwatch, scan = Stopwatch(), None
    with guard(frame), stopwatch.stage("read"):
        scan = frame.read()
    with stopwatch.stage("register"):
        registration = odometry.register(frame, scan)
    if scan is not None and not registration.trusted:
        warn(f"{frame.name}: not to be trusted: {registration.reason}")
    watch(frame, registration, stopwatch)
    return registration


def _write(found: FoundPoses, form: PoseFormat) -> None:
    registrations = found.registrations
    moves = registrations[1:] or registrations
    if not any(each.trusted for each in moves):
        raise InputError(
            found.file,
            "was not written: no two scans of the recording could be registered to one another "
            f"({moves[0].reason})",
            "Check that they are consecutive, in order of time, and of one sensor.",
        )
    poses = np.array([each.pose for each in registrations])
    times = np.array(found.times) if form == "tum" else None
    write_trajectory(found.file, Trajectory(poses, times))


def _files_of(recordings: Sequence[Sequence[Frame]], out: Path, replace: bool) -> list[Path]:
    """The file of each recording's poses, once it is known that it can be written.

    Args:
        recordings: The recordings.
        out: The file of the only one; of several, a folder with ``<sequence>.txt`` for each.
        replace: True if poses that came with the scans may be replaced.

    Raises:
        InputError: A file that cannot be written, that came with the scans, or that two recordings
            would share.
    """
    files = [out]
    if len(recordings) > 1:
        files = [out / f"{recording[0].sequence}.txt" for recording in recordings]
    for place, (file, recording) in enumerate(zip(files, recordings, strict=True)):
        if file in files[:place]:
            raise InputError(
                recording[0].name,
                f"another recording is called {recording[0].sequence} too, and the poses of both "
                f"would be {file}",
                "Process them in two runs, each to its --out.",
            )
        _refuse_to_overwrite(file, recording, replace)
        require_writable(file)
    return files


def _refuse_to_overwrite(file: Path, recording: Sequence[Frame], replace: bool) -> None:
    target = os.path.realpath(file)
    for frame in recording:
        if target in (
            os.path.realpath(frame.name),
            os.path.realpath(frame.label_path or frame.name),
        ):
            raise InputError(file, "is one of the scans or their labels", "Name another file.")
    scans = Path(recording[0].name).parent
    records = [Path(folder, name) for folder in (scans, folder_above(scans)) for name in RECORDS]
    for record in records:
        if os.path.realpath(record) != target or not is_file(file):
            continue
        if record.name != POSES:
            raise InputError(file, "came with the scans", "Name another file.")
        if not replace:
            raise InputError(
                file,
                "holds poses that came with the scans",
                "Name another file, or replace them with --replace.",
            )


def _times(recording: Sequence[Frame], form: PoseFormat) -> list[float]:
    """Times of the scans of a recording, seconds; empty if not all of them are known.

    Raises:
        InputError: Times that are missing or do not ascend, for ``tum``.
    """
    times = times_of(recording)
    if form != "tum":
        return times or []
    if times is None:
        lacking = next(frame for frame in recording if frame.time is None)
        raise InputError(
            lacking.name,
            "its time is not known, and a line of TUM's format begins with the time",
            "Write a times.txt beside the scans, a line of seconds each, or use --format kitti.",
        )
    # Poses are found again by their times, which have to ascend.
    for (earlier, later), frame in zip(pairwise(times), recording[1:], strict=True):
        if later <= earlier:
            raise InputError(
                frame.name,
                f"was taken at {later:.3f} s, the scan before it at {earlier:.3f} s, and TUM's "
                "format requires ascending times",
                "Name the scans in the order that they were taken in, or use --format kitti.",
            )
    return times
