"""Finds the scans, data sets, bags and recordings at the paths that a user names."""

import os
from collections import Counter
from collections.abc import Iterable, Iterator, Sequence
from glob import escape, glob
from pathlib import Path

from derain.bags.names import SUFFIXES as BAG_SUFFIXES
from derain.bags.names import bags_at, is_bag, split
from derain.cards.known import known_layouts
from derain.cards.layout import Layout
from derain.errors import InputError, counted
from derain.files import RECORDS, find_scans
from derain.files.atomic import writing
from derain.files.format import FORMATS
from derain.files.names import scan_suffix
from derain.files.reading import reading
from derain.jobs.job import FOLDER as JOB_RECORDS
from derain.system.notices import warn_once

# Scans may be text files, but a text file in a folder of recordings is usually a note or a record.
TEXTS = (".csv", ".txt")

# File that only a simulated data set has.
MANIFEST_OF_SIMULATION = "manifest.json"


def listed_scans(paths: Iterable[Path]) -> list[Path]:
    """The scans in files and folders; arguments and errors as for `find_scans`.

    A warning counts other files that may be scans or bags, for instance text files beside scans of
    other formats.
    """
    scans: list[Path] = []
    for path in paths:
        found = find_scans([path])
        scans += found
        _warn_of_others(path, found)
    return scans


def scan_folders(root: Path, layout: Layout) -> list[Path]:
    """The folders of scans in a data set, or in a part of one, sorted by name.

    Args:
        root: A folder with a folder of sequences, the folder of sequences, a sequence, or its
            folder of scans.
        layout: Layout of the data set.

    Returns:
        The folders; an empty list if the root is no such folder.
    """
    whole = Path(os.path.abspath(root))
    if whole.name == layout.scans and (whole.parent / layout.labels).is_dir():
        return [root]
    for sequences in (f"{escape(layout.sequences)}/*/", "*/", ""):
        # Path.glob would also find hidden folders, such as unfinished ones of `derain simulate`.
        if found := glob(f"{sequences}{escape(layout.scans)}/", root_dir=root):
            return [root / folder for folder in sorted(found)]
    return []


def find_layout(root: Path, layouts: Iterable[Layout] | None = None) -> Layout | None:
    """The layout of a data set or of a part of one; None if no layout fits.

    Args:
        root: As for :func:`scan_folders`.
        layouts: Candidates, the likeliest first; by default those of the packaged data cards.
    """
    known = known_layouts() if layouts is None else layouts
    return next((layout for layout in known if scan_folders(root, layout)), None)


def recordings_below(
    folder: Path, layouts: Sequence[Layout] | None = None, results: Sequence[Path] = ()
) -> list[Path]:
    """Finds the recordings in a folder of them: folders of scans, sequences and bags at any depth.

    Args:
        folder: The folder, or any other path.
        layouts: As for :func:`named_frames`.
        results: Folders to pass over. Hidden folders, and those with records of a job, are passed
            over, too, and folders of texts alone.

    Returns:
        Their paths, sorted. The list is empty if the path is a file, a folder with scans or bags
        directly in it, or a data set or a part of one: :func:`named_frames` takes these whole.
    """
    takes_none = layouts is not None and not layouts
    if takes_none or not os.path.isdir(folder) or _holds_scans(folder):
        return []
    if bags := bags_at(folder):
        # Among folders that are bags, one that lacks its metadata looks like any other.
        _warn_of_others_beside(folder, _Search(folder, layouts, [*results, *bags]))
        return []
    if scans := _laid_out(folder, layouts):
        whole = Path(os.path.realpath(folder))
        sequences = [Path(os.path.realpath(each.parent)) for each in scans]
        if all(sequence.parent == whole for sequence in sequences):
            _warn_of_others_beside(folder, _Search(folder, layouts, [*results, *sequences]))
        return []
    found = sorted({*_Search(folder, layouts, results).inside(folder)})
    if found:
        _warn_of_others(folder, found)
    return found


def _laid_out(root: Path, layouts: Sequence[Layout] | None) -> list[Path]:
    """The folders of scans of a data set or of a part of one; empty if no layout fits."""
    layout = find_layout(root, layouts)
    return [] if layout is None else scan_folders(root, layout)


def _warn_of_others_beside(folder: Path, search: "_Search") -> None:
    """Warns of recordings beside the bags or sequences that lie directly in a folder."""
    if others := [*search.inside(folder)]:
        recordings = counted(len(others), "other recording")
        warn_once(
            f"{folder}: {recordings} passed over, such as {others[0]}; name them to read them"
        )


class _Search:
    """A search for recordings, which enters each folder once.

    Args:
        root: The folder that it begins in.
        layouts: As for :func:`named_frames`.
        results: Folders to pass over.
    """

    def __init__(
        self, root: Path, layouts: Sequence[Layout] | None, results: Sequence[Path]
    ) -> None:
        self._root = Path(os.path.realpath(root))
        self._layouts = layouts
        self._entered = set(map(os.path.realpath, results))

    def inside(self, folder: Path) -> Iterator[Path]:
        """The recordings in a folder; one that cannot be read is warned of."""
        for each in self._folders_in(folder):
            try:
                yield from self._at(each)
            except InputError as error:
                warn_once(f"{error} It is passed over.")

    def _at(self, folder: Path) -> Iterator[Path]:
        """The recordings that a folder is, or that lie in it."""
        if is_bag(folder):
            yield folder
            return
        if _holds_scans(folder):
            yield folder
        sequences = [each.parent for each in _laid_out(folder, self._layouts)]
        yield from sequences
        if all(sequence.parent == folder for sequence in sequences):  # else it is a data set
            yield from bags_at(folder)
            yield from self.inside(folder)

    def _folders_in(self, folder: Path) -> list[Path]:
        """The folders in a folder that are to be entered, links last."""
        with reading(folder), os.scandir(folder) as entries:
            inside = [each for each in entries if each.is_dir() and not each.name.startswith(".")]
        found = []
        for entry in sorted(inside, key=lambda each: (each.is_symlink(), each.name)):
            place = os.path.realpath(entry.path)
            leads_up = self._root.is_relative_to(place)
            if not leads_up and place not in self._entered and not _is_of_job(place):
                found.append(folder / entry.name)
            self._entered.add(place)
        return found


def mark_as_results(folder: Path) -> None:
    """Has a later search pass over a folder of results, by an empty folder of records.

    Raises:
        InputError: It cannot be made, for instance because the disk is full.
    """
    with writing(folder):
        (folder / JOB_RECORDS).mkdir(exist_ok=True)


def _is_of_job(folder: str) -> bool:
    """True if a folder holds results with records; a simulated data set has records, too."""
    names = (JOB_RECORDS, MANIFEST_OF_SIMULATION)
    has_records, is_data_set = (os.path.exists(os.path.join(folder, name)) for name in names)
    return has_records and not is_data_set


def scans_or_bags(path: Path, layouts: Sequence[Layout] | None) -> tuple[list[Path], list[Path]]:
    """Finds the scans at a path, or else the bags.

    Args:
        path: A scan, a folder of scans, a data set or a part of one, a bag, a path into one, or a
            folder of bags.
        layouts: Layouts of data sets, the likeliest first; None for those of the packaged cards.

    Returns:
        The scans and the bags; one of the two lists is empty.

    Raises:
        InputError: There is neither.
    """
    folders = []
    if os.path.isdir(path):
        folders = [path] if _holds_scans(path) else _laid_out(path, layouts)
    if not folders and (bags := [path] if split(path) is not None else bags_at(path)):
        _warn_of_others(path, bags)
        return [], bags
    return listed_scans(folders or [path]), []


def _holds_scans(folder: Path) -> bool:
    """True if scans lie directly in a folder; text files do not count, for they may be notes.

    The search ends at the first scan: a folder of a hundred thousand scans is not listed twice.
    """
    with reading(folder), os.scandir(folder) as entries:
        return any(
            (suffix := scan_suffix(Path(entry.name))) not in TEXTS
            and suffix in FORMATS
            and not entry.name.startswith(".")
            and entry.is_file()
            for entry in entries
        )


def _warn_of_others(path: Path, taken: Sequence[Path]) -> None:
    """Warns of possible scans and bags in a folder that are not taken."""
    if taken == [path]:  # a file
        return
    names = {each.name for each in taken}
    with reading(path), os.scandir(path) as entries:
        others = Counter(_kind(entry) for entry in entries if entry.name not in names)
    del others[""]
    if others:
        counts = ", ".join(f"{number:,} {kind}" for kind, number in sorted(others.items()))
        warn_once(f"{path}: {counts} passed over; name them to have them read")


def _kind(entry: os.DirEntry[str]) -> str:
    """The suffix of a possible scan or bag; an empty string for anything else."""
    if entry.name.startswith(".") or entry.name in RECORDS:
        return ""
    if entry.is_dir():
        return "folder of a bag" if is_bag(Path(entry.path)) else ""
    suffix = scan_suffix(Path(entry.name))
    return suffix if suffix in FORMATS or suffix in BAG_SUFFIXES else ""
