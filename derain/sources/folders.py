"""Scans in files and folders, as a user names them."""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Sequence
from glob import glob
from pathlib import Path

from derain.cards.known import known_layouts, label_of
from derain.cards.layout import Layout, sequence_of
from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS, find_scans
from derain.files.labels import LABEL
from derain.files.names import scan_stem
from derain.files.reading import reading
from derain.sources.file_frame import FileFrame
from derain.sources.records import Records
from derain.sources.source import Frames


def named_frames(
    paths: Sequence[Path], columns: Sequence[str] = DEFAULT_COLUMNS, labelled: bool = False
) -> Frames:
    """The scans that a user names.

    Args:
        paths: Scans, folders with scans directly in them, and data sets or parts of them whose
            folders are called as a packaged data card says.
        columns: Names of the columns of files that do not name them.
        labelled: Whether labels are to be read, from where :func:`~derain.cards.known.label_of`
            finds them.

    Returns:
        The scans in the order they are named, those of a folder sorted by name. Each has its stem
        for a key; where a data set is named, its path from the folder that all scans lie below.

    Raises:
        InputError: A path that does not exist, or a folder without scans.
    """
    scans: list[Path] = []
    of_data_set = False
    for path in paths:
        folders = _scan_folders_in(path)
        of_data_set = of_data_set or len(folders) > 1
        scans += find_scans(folders or [path])
    where = label_of if labelled else _nowhere
    return frames_of(scans, where, columns, relative_keys(scans) if of_data_set else None)


def frames_of(
    scans: Sequence[Path],
    label_path: Callable[[Path], Path | None],
    columns: Sequence[str],
    keys: Sequence[str] | None = None,
) -> Frames:
    """Frames of files, each folder of which is a sequence.

    Args:
        scans: The files, in order.
        label_path: Where the labels of a scan are to be read, if they are.
        columns: Names of the columns of files that do not name them.
        keys: What the frames are named by; None takes the stems of the files.
    """
    records = {folder: Records(folder) for folder in {scan.parent for scan in scans}}
    places = Counter[Path]()
    frames = []
    for scan, key in zip(scans, keys or map(scan_stem, scans), strict=True):
        frames.append(
            FileFrame(
                key=key,
                sequence=sequence_of(scan),
                number=places[scan.parent],
                label_path=label_path(scan),
                path=scan,
                columns=tuple(columns),
                records=records[scan.parent],
            )
        )
        places[scan.parent] += 1
    return Frames(frames)


def sequence_frames(
    folders: Iterable[Path], layout: Layout, columns: Sequence[str] = DEFAULT_COLUMNS
) -> Frames:
    """The scans of a data set's sequences.

    Args:
        folders: The sequences' folders, in order.
        layout: What the folders in them are called.
        columns: Names of the columns of files that do not name them.

    Raises:
        InputError: A sequence without scans.
    """
    scans = [scan for folder in folders for scan in find_scans([folder / layout.scans])]

    def label_path(scan: Path) -> Path:
        return scan.parent.parent / layout.labels / f"{scan_stem(scan)}{LABEL}"

    return frames_of(scans, label_path, columns, relative_keys(scans))


def relative_keys(scans: Sequence[Path]) -> list[str]:
    """Paths without suffixes, from the folder that all the scans lie below."""
    if not scans:
        return []
    root = os.path.commonpath([scan.parent for scan in scans])
    relative = (Path(os.path.relpath(scan, root)) for scan in scans)
    return [path.with_name(scan_stem(path)).as_posix() for path in relative]


def scan_folders(root: Path, layout: Layout) -> list[Path]:
    """The folders of scans in a data set, or in a part of one, sorted by name.

    Args:
        root: A folder with a folder of sequences, the folder of sequences, a sequence, or its
            folder of scans.
        layout: What the folders are called.

    Returns:
        None of them where the root is none of this.
    """
    whole = root.absolute()
    if whole.name == layout.scans and (whole.parent / layout.labels).is_dir():
        return [root]
    for sequences in (f"{layout.sequences}/*/", "*/", ""):
        # Not Path.glob, which finds hidden folders too: what `derain simulate` has not finished.
        if found := glob(f"{sequences}{layout.scans}/", root_dir=root):
            return [root / folder for folder in sorted(found)]
    return []


def find_layout(root: Path, layouts: Iterable[Layout] | None = None) -> Layout | None:
    """The layout that a data set, or a part of one, has; None where none is known.

    Args:
        root: As for :func:`scan_folders`.
        layouts: Those that it may have, the likeliest first; by default those of the packaged
            data cards.
    """
    known = known_layouts() if layouts is None else layouts
    return next((layout for layout in known if scan_folders(root, layout)), None)


def _scan_folders_in(path: Path) -> list[Path]:
    """The folders of scans of a data set; none for a scan or a folder of scans."""
    with reading(path):
        if not path.is_dir() or _holds_scans(path):
            return []
    layout = find_layout(path)
    return [] if layout is None else scan_folders(path, layout)


def _holds_scans(folder: Path) -> bool:
    try:
        return bool(find_scans([folder]))
    except InputError:
        return False


def _nowhere(scan: Path) -> Path | None:
    return None
