"""Times and poses of the scans of a folder, from the records that lie beside them.

- ``times.txt``: a line a scan, seconds. Or ``metadata.csv``, see :mod:`derain.files.frame_times`.
- ``poses.txt``: a line a scan, or poses by time; see :mod:`derain.sources.trajectory`.
"""

from collections.abc import Callable, Iterator, Sequence
from functools import cached_property, lru_cache
from pathlib import Path

from derain.errors import InputError
from derain.files import find_scans
from derain.files.frame_times import METADATA, read_frame_times
from derain.files.names import scan_stem
from derain.files.reading import is_file, stamp_of
from derain.scan import Floats
from derain.sources.frame import Frame, times_of
from derain.sources.number_lines import read_numbers
from derain.sources.trajectory import CALIBRATION, Trajectory, read_trajectory

TIMES, POSES = "times.txt", "poses.txt"


class Records:
    """Times and poses of the scans in one folder, read when the first is needed.

    Most methods need neither, and then nothing is read, damaged or not.

    Args:
        folder: The folder of scans. Its records lie in it, or in the folder that it lies in.
    """

    def __init__(self, folder: Path) -> None:
        self.folder = folder

    def time_of(self, scan: Path) -> float | None:
        """Time at which a scan of the folder was taken, seconds; None if not known.

        Raises:
            InputError: A record that is damaged or does not fit the scans.
        """
        times = self._times
        return None if times is None else float(times[self._line(scan, TIMES, len(times))])

    def pose_of(self, scan: Path) -> Floats | None:
        """Sensor to world of a scan of the folder, float64 (4, 4), metres; None if not known.

        Raises:
            InputError: A record that is damaged or does not fit the scans.
        """
        trajectory = self._trajectory
        if trajectory is None:
            return None
        # Where the poses have no times, those of the scans are not read, damaged or not.
        times = None if trajectory.times is None else self._times
        if times is not None and trajectory.is_by_time(times):
            return trajectory.at(float(times[self._line(scan, TIMES, len(times))]), scan.name)
        pose: Floats = trajectory.poses[self._line(scan, POSES, len(trajectory))]
        return pose

    @cached_property
    def stamp(self) -> str:
        """Sizes and times of change of the records that are there."""
        beside = (self._beside(name) for name in (TIMES, POSES, CALIBRATION))
        places = (*beside, self.folder / METADATA)
        return " ".join(stamp_of(path) for path in places if path is not None and is_file(path))

    def __reduce__(self) -> tuple[Callable[[Path], "Records"], tuple[Path]]:
        return records_of, (self.folder,)  # a copy in another process reads them again

    @cached_property
    def _times(self) -> Floats | None:
        """Seconds of each scan or line, float64 (T,)."""
        if path := self._beside(TIMES):
            return read_numbers(path, 1)[:, 0]
        if is_file(self.folder / METADATA):
            return read_frame_times(self._scans)
        return None

    @cached_property
    def _trajectory(self) -> Trajectory | None:
        path = self._beside(POSES)
        return None if path is None else read_trajectory(path)

    @cached_property
    def _scans(self) -> list[Path]:
        return find_scans([self.folder])

    @cached_property
    def _places(self) -> dict[str, int]:
        return {scan.name: place for place, scan in enumerate(self._scans)}

    def _line(self, scan: Path, record: str, lines: int) -> int:
        """The line of a record that belongs to a scan."""
        path = self._beside(record) or self.folder / METADATA
        return line_of(path, lines, scan.name, self._places.get(scan.name), len(self._scans))

    def _beside(self, name: str) -> Path | None:
        """A record in the folder of scans or in that above it."""
        folder = self.folder.absolute()
        places = (folder / name, folder.parent / name)
        return next((place for place in places if is_file(place)), None)


@lru_cache(maxsize=16)
def records_of(folder: Path) -> Records:
    """The records of a folder, which frames that come from another process share."""
    return Records(folder)


def poses_along(recording: Sequence[Frame], trajectory: Trajectory) -> Iterator[Floats]:
    """The pose of each frame of a recording, float64 (4, 4), metres.

    Args:
        recording: The frames.
        trajectory: Poses by time where the scans have times of the same clock, else line by line.

    Raises:
        InputError: It does not fit the scans.
    """
    names = [Path(frame.name).name for frame in recording]
    if trajectory.times is not None:  # else the scans' own are not read, damaged or not
        times = times_of(recording)
        if times is not None and trajectory.is_by_time(times):
            yield from map(trajectory.at, times, names)
            return
    for place, name in enumerate(names):
        record, lines = Path(trajectory.name), len(trajectory)
        yield trajectory.poses[line_of(record, lines, name, place, len(recording))]


def line_of(record: Path, lines: int, scan: str, place: int | None, scans: int) -> int:
    """The line of a record that belongs to a scan, from 0.

    A record with a line for each scan goes by their order. One with other lines goes by the numbers
    that the scans are named by, as where only some scans of a sequence were copied.

    Args:
        record: The record, for messages.
        lines: Number of lines that it has.
        scan: Name of the scan's file.
        place: The scan's place among all of its sequence; None if it is not one of them.
        scans: Their number.

    Raises:
        InputError: There is no such line.
    """
    if lines == scans and place is not None:
        return place
    stem = scan_stem(Path(scan))
    # Only ASCII: other scripts have digits too, and int() reads them.
    if not (stem.isascii() and stem.isdigit() and int(stem) < lines):
        raise InputError(
            record,
            f"has {lines:,} lines for {scans:,} scans, and none for {scan}",
            "Write a line for each scan of the folder, or for each number up to the last.",
        )
    return int(stem)
