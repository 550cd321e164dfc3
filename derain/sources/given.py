"""Scans as a Python program gives them: in memory, as paths, or as a source."""

from collections.abc import Iterable, Sequence
from pathlib import Path

from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.frame import Frame, MemoryFrame
from derain.sources.source import Frames, Source

# One of them, or several of one kind or another.
GivenScans = Source | Scan | Frame | str | Path | Iterable[Scan | Frame | str | Path]


def source_of(scans: GivenScans, columns: Sequence[str] = DEFAULT_COLUMNS) -> Source:
    """The source that a program means, with the labels that its scans have.

    Args:
        scans: A source; or one or more scans in memory, frames, files and folders of scans.
        columns: Names of the columns of files that do not name them.

    Raises:
        InputError: No scans, something else than scans, a path that does not exist, or a folder
            without scans.
    """
    if isinstance(scans, Source):
        return scans
    given = [scans] if isinstance(scans, Scan | Frame | str | Path) else list(scans)
    frames = [
        frame for place, item in enumerate(given) for frame in _frames_of(item, place, columns)
    ]
    if not frames:
        raise InputError("scans", "there are none", "Give one or more.")
    return Frames(frames)


def _frames_of(item: object, place: int, columns: Sequence[str]) -> Sequence[Frame]:
    match item:
        case Frame():
            return [item]
        case Scan():
            return [MemoryFrame(key=f"{place:06d}", number=place, scan=item)]
        case str() | Path():
            return named_frames([Path(item)], columns, labelled=True)
    raise InputError(
        "scans", f"{type(item).__name__} is no scan", "Give Scans, or paths of files and folders."
    )
