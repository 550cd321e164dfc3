"""Finds where a sensor was, scan by scan, and writes its poses."""

import math
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from dataclasses import replace as replaced
from pathlib import Path
from statistics import median

import numpy as np
from tqdm import tqdm

from derain.errors import InputError
from derain.files.atomic import require_writable
from derain.files.reading import is_file
from derain.recordings.odometry import FrameOdometry, Registration
from derain.sources.frame import Frame
from derain.sources.judging import Guard, unguarded
from derain.sources.recordings import recordings_of
from derain.sources.source import Source
from derain.sources.trajectory import write_trajectory
from derain.system.notices import warn
from derain.system.stopwatch import Stopwatch

# Receives the registration of each scan as soon as it is found, and the times of its stages.
Watch = Callable[[Frame, Registration, Stopwatch], None]


@dataclass(frozen=True)
class FoundPoses:
    """The poses of one recording; as text, a summary in one line.

    Attributes:
        file: The file or folder to write to.
        frames: The scans, in time order.
        registrations: Registration of each scan.
        fault: Why the file could not be written; None where it is.
    """

    file: Path
    frames: Sequence[Frame]
    registrations: Sequence[Registration]
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
        residuals = [
            (each.residual, frame.key)
            for each, frame in zip(moves, self.frames[1:], strict=True)
            if not math.isnan(each.residual)
        ]
        worst, of_scan = max(residuals, default=(math.nan, "none"))
        usual = median([residual for residual, _ in residuals] or [math.nan])
        return (
            f"{self.file}: {len(self.registrations):,} scans, path {path:.1f} m, "
            f"{path / len(moves):.2f} m a scan; residual median {usual:.3f} m, worst "
            f"{worst:.3f} m ({of_scan}); {self.untrusted:,} not to be trusted"
        )


def find_poses(
    source: Source,
    out: Path,
    *,
    replace: bool = False,
    threads: int = 0,
    guard: Guard = unguarded,
    watch: Watch = lambda frame, registration, stopwatch: None,
) -> list[FoundPoses]:
    """Registers every scan with the one before it, and writes the poses of each recording.

    Args:
        source: Scans of one recording or more, in time order.
        out: The file of the only recording; of several, a folder with ``<sequence>.txt`` for each.
        replace: True if files that exist may be replaced.
        threads: Threads to use; 0 takes every core.
        guard: Surrounds the reading of each scan; one whose error it holds back is not trusted.
        watch: Receives each registration.

    Returns:
        The poses of each recording, in the order of the source.

    Raises:
        InputError: A file that cannot be written, that exists, or that two recordings would share;
            a scan that cannot be read, where the guard lets that through.
    """
    recordings = recordings_of(source)
    files = _files_of(recordings, out, replace)
    odometry = FrameOdometry(threads)
    found = []
    with tqdm(total=len(source), desc="odometry", unit="scan", disable=None) as bar:
        for file, recording in zip(files, recordings, strict=True):
            registrations = []
            for frame in recording:
                registrations.append(_register(frame, odometry, guard, watch))
                bar.update()
            poses = FoundPoses(file, recording, registrations)
            try:
                _write(poses)
            except InputError as error:  # the other recordings go on
                poses = replaced(poses, fault=error)
            found.append(poses)
    return found


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


def _write(found: FoundPoses) -> None:
    registrations = found.registrations
    moves = registrations[1:] or registrations
    if not any(each.trusted for each in moves):
        raise InputError(
            found.file,
            "was not written: no two scans of the recording could be registered to one another "
            f"({moves[0].reason})",
            "Check that they are consecutive, in order of time, and of one sensor.",
        )
    write_trajectory(found.file, np.array([each.pose for each in registrations]))


def _files_of(recordings: Sequence[Sequence[Frame]], out: Path, replace: bool) -> list[Path]:
    """The file of each recording's poses, once it is known that it can be written.

    Args:
        recordings: The recordings.
        out: The file of the only one; of several, a folder with ``<sequence>.txt`` for each.
        replace: True if files that exist may be replaced.

    Raises:
        InputError: A file that cannot be written, that exists, or that two recordings would share.
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
        if is_file(file) and not replace:
            raise InputError(file, "exists", "Name another file, or replace it with --replace.")
        require_writable(file)
    return files
