"""The units that a source splits into: recordings, bags, or blocks of scans of long recordings."""

import os
from collections.abc import Callable, Iterator, Mapping, Sequence
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cached_property
from hashlib import sha256
from pathlib import Path
from typing import Any, Self

import derain
from derain.errors import InputError
from derain.jobs.job import Job
from derain.jobs.shard import Shard
from derain.jobs.unit import Unit
from derain.sources.bag_frame import BagFrame
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.method import Method
from derain.sources.recordings import recordings_of
from derain.sources.stored_frame import StoredBag, StoredFrame
from derain.sources.window import Window
from derain.stores.mirror import mirror
from derain.stores.url import Place, is_url

# Scans of a block: a few seconds of a drive, beside which the scans around a block that are read
# once more take little.
BLOCK = 50


@dataclass(frozen=True)
class Division:
    """The division of a source into units.

    Example:
        >>> report = derain.clean(
        ...     "scan.bin", derain.Derainer(), "cleaned", division=Division(keep_records=True)
        ... )
        >>> len(report.scans), report.before
        (1, 0)

    Attributes:
        block: Scans of a block of a long recording.
        shard: The shard of the units that is done; None for all.
        keep_records: True if records are kept even of fewer scans than a block has.
        anew: True to do everything again, even if the records are of other options.
    """

    block: int = BLOCK
    shard: Shard | None = None
    keep_records: bool = False
    anew: bool = False

    def keeps_records(self, source: Sequence[Frame], folder: Place) -> bool:
        """True if each unit has a record: on request, for a run begun before, or for many scans.

        Args:
            source: The scans.
            folder: The folder of the results.
        """
        requested = self.keep_records or self.anew or self.shard is not None
        return requested or len(source) > self.block or Job.is_begun(folder)

    def begin(
        self, folder: Place, options: Mapping[str, Any], units: "list[FrameUnit]"
    ) -> "tuple[Job, list[FrameUnit]]":
        """Starts a job, or resumes the one of the folder.

        Args:
            folder: The folder of the results.
            options: Options that the results depend on besides the inputs.
            units: All units.

        Returns:
            The job, and the units that are done now.

        Raises:
            InputError: The folder is of a job with other options, or cannot be written.
        """
        return Job.begin(folder, options, units, self.shard, self.anew)


@dataclass(frozen=True, eq=False, kw_only=True)
class FrameUnit(Unit):
    """Frames that are judged together, of one recording.

    Attributes:
        frames: Those that are judged, in time order.
        before: Those before them that the method sees.
        after: Those after them that it sees.
    """

    frames: tuple[Frame, ...]
    before: tuple[Frame, ...] = ()
    after: tuple[Frame, ...] = ()

    @cached_property
    def by_key(self) -> dict[str, Frame]:
        """The frames that are judged, by their keys."""
        return {frame.key: frame for frame in self.frames}

    def of(self, change: Callable[[Sequence[Frame]], Sequence[Frame]]) -> Self:
        """The same of other frames.

        Args:
            change: Makes the frames of each part, those that are judged and those around them.
        """
        parts = (self.frames, self.before, self.after)
        frames, before, after = (tuple(change(part)) for part in parts)
        return replace(self, frames=frames, before=before, after=after)

    @contextmanager
    def fetched(self) -> Iterator[tuple[Self, Callable[[InputError], InputError]]]:
        """Lends the unit with all files on this machine, while the block runs.

        Yields:
            The unit, and a function that replaces its files by URLs in errors.

        Raises:
            InputError: A scan or a bag of a store cannot be fetched whole. Then nothing of the unit
                is done, because the result of one scan may depend on the others.
        """
        frames = (*self.before, *self.frames, *self.after)
        stored = [frame for frame in frames if isinstance(frame, StoredFrame)]
        if not stored:
            yield self, lambda error: error
            return
        with mirror() as where:
            where.fetch(each for frame in stored for each in frame.objects)

            def here(frames: Sequence[Frame]) -> list[Frame]:
                found: list[Frame] = []
                for frame in frames:
                    found += frame.fetched(where) if isinstance(frame, StoredFrame) else [frame]
                return found

            yield self.of(here), where.error_with_urls


def units_of(source: Sequence[Frame], method: Method | None, block: int = BLOCK) -> list[FrameUnit]:
    """Splits a source so that the method judges each unit as it would judge the whole source.

    A bag is one unit, because it is written as a whole. A recording is one unit if the result of
    each scan may depend on all others. Other recordings are split into blocks of scans.

    Args:
        source: Frames in time order, one recording after the other.
        method: Method that judges them; None where each scan is seen by itself.
        block: Scans of a block.

    Returns:
        The units, in the order of the source. A unit has the key of its first frame for an id.
    """
    return [unit for each in recordings_of(source) for unit in _units_of(each, method, block)]


def whole(source: Sequence[Frame]) -> FrameUnit:
    """All frames of a source as one unit, without a record."""
    return FrameUnit(id="", size=0, inputs="", frames=tuple(source))


def shared_options(command: str, source: Sequence[Frame], block: int) -> dict[str, Any]:
    """The options that the results of any command depend on besides the scans, for its job.

    Args:
        command: Name of the command.
        source: The scans.
        block: Scans of a block.
    """
    files = [frame for frame in source if isinstance(frame, FileFrame)]
    return {
        "command": command,
        "derain": derain.__version__,
        "block": block,
        "columns": sorted({",".join(frame.columns) for frame in files}),
        "intensity_scale": sorted({frame.intensity_scale for frame in source}),
    }


def folder_of_paths(source: Sequence[Frame], *places: Place) -> Path | None:
    """The folder that relative paths start from; None if there are none.

    Args:
        source: The scans.
        places: Other paths and URLs.
    """
    files = [each for each in source if isinstance(each, FileFrame)]
    paths = [each.path for each in files if not isinstance(each, StoredFrame)]
    paths += [Path(place) for place in places if not is_url(place)]
    return None if all(path.is_absolute() for path in paths) else Path.cwd()


def _units_of(recording: Sequence[Frame], method: Method | None, block: int) -> Iterator[FrameUnit]:
    """The units of one recording."""
    window = Window() if method is None else method.depends_on(recording)
    if window is None or isinstance(recording[0], BagFrame | StoredBag):
        window, block = Window(), len(recording)
    for begin in range(0, len(recording), block):
        yield _unit(recording, begin, begin + block, window)


def _unit(recording: Sequence[Frame], begin: int, end: int, window: Window) -> FrameUnit:
    frames = tuple(recording[begin:end])
    before = tuple(recording[max(begin - window.before, 0) : begin])
    after = tuple(recording[end : end + window.after])
    stamps = os.fsencode("\n".join(map(_stamp, (*before, *frames, *after))))
    return FrameUnit(
        id=frames[0].key,
        size=sum(map(_size, frames)),
        inputs=sha256(stamps).hexdigest()[:16],
        frames=frames,
        before=before,
        after=after,
    )


def _size(frame: Frame) -> int:
    try:
        return frame.size()
    except InputError:  # reported when the frame is read
        return 0


def _stamp(frame: Frame) -> str:
    """The frame's name, and what changes when its file or its pose does."""
    matrix = frame.sensor_to_world
    pose = "" if matrix is None else sha256(matrix.tobytes()).hexdigest()
    try:
        return f"{frame.key} {frame.stamp()} {pose}"
    except InputError:
        return f"{frame.key} {pose}"
