"""Frames of the files and folders that a user names, and of the scans that a program passes."""

import os
from collections import Counter
from collections.abc import Callable, Iterable, Iterator, Sequence
from dataclasses import dataclass, replace
from functools import partial
from itertools import chain, groupby, islice
from pathlib import Path

from derain.bags.names import bags_at, is_bag, split, stem
from derain.cards.known import label_of
from derain.cards.layout import Layout, sequence_of
from derain.errors import InputError
from derain.example import or_example
from derain.files import DEFAULT_COLUMNS
from derain.files.names import scan_stem
from derain.scan import Scan
from derain.sources.bag_frame import UnreadableBag, bag_frames
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame, MemoryFrame
from derain.sources.records import Records
from derain.sources.search import recordings_below, scans_or_bags
from derain.sources.source import Frames, Source
from derain.stores.url import is_url, paths_of

# Returns the clouds of a bag, or those at a path into one. Arguments: the path; whether to read
# labels; the prefix of the keys, which may be empty.
FramesOfBag = Callable[[Path, bool, str], Sequence[Frame]]

# Argument of public functions: one item, or several items of any of these kinds.
GivenScans = Source | Scan | Frame | str | Path | Iterable[Scan | Frame | str | Path]


def named_frames(
    paths: str | Path | Iterable[str | Path],
    columns: Sequence[str] = DEFAULT_COLUMNS,
    labelled: bool = False,
    layouts: Sequence[Layout] | None = None,
    recordings: bool = False,
    topic: str | None = None,
    results: Sequence[Path] = (),
) -> Frames:
    """The scans that a user names.

    Example:
        >>> source = named_frames("scan.bin", labelled=True)
        >>> [(frame.key, len(frame.read()), frame.has_labels) for frame in source]
        [('scan', 820, True)]

    Args:
        paths: One path or several: scans; folders with scans directly in them; data sets or parts
            of them with the folder names of a layout; bags and paths into bags
            (:func:`~derain.sources.bag_frame.bag_frames`); folders with any of these at any depth
            (folders of recordings); or ``example``, which comes with derain.
        columns: Names of the columns of files that do not name them.
        labelled: True to read labels. :func:`~derain.cards.known.label_of` finds them by the
            layouts.
        layouts: Layouts of data sets, the likeliest first; by default those of the packaged data
            cards. An empty sequence excludes data sets and folders of recordings.
        recordings: True if each folder is a recording, with numbers that may occur in others, too.
        topic: Topic of the bags among them; None if each has only one topic of clouds.
        results: Folders of results, which are skipped in a folder of recordings.

    Returns:
        The scans in the order of the paths; those of a folder are sorted by name. A scan's key is
        its stem. If a data set or several recordings are named, the key is the scan's path relative
        to the common parent folder of all scans. In a folder of recordings, the key begins with the
        recording's path relative to that folder, which does not change if others are added.

    Raises:
        InputError: A URL, a path that does not exist, a folder without scans, a named bag that
            cannot be read, or a topic where there is no bag. A bag in a folder fails when it is
            read.
    """
    given = [paths] if isinstance(paths, str | Path) else paths
    finder = FrameFinder(columns, labelled, layouts, recordings, topic, results)
    return finder.frames([or_example(path) for path in paths_of(given)])


@dataclass(frozen=True)
class FrameFinder:
    """Finds the scans at paths; attributes are as for :func:`named_frames`.

    Attributes:
        columns: Names of the columns of files that do not name them.
        labelled: True to read labels.
        layouts: Layouts of data sets.
        recordings: True if each folder is a recording.
        topic: Topic of the bags.
        results: Folders of results, which are no recordings.
        frames_of_bag: Returns the clouds of a bag.
    """

    columns: Sequence[str] = DEFAULT_COLUMNS
    labelled: bool = False
    layouts: Sequence[Layout] | None = None
    recordings: bool = False
    topic: str | None = None
    results: Sequence[Path] = ()
    frames_of_bag: FramesOfBag = bag_frames

    def frames(self, paths: Sequence[Path]) -> Frames:
        """The scans at paths, in their order; errors as :func:`named_frames` raises them."""
        below = [recordings_below(path, self.layouts, self.results) for path in paths]
        if self.topic is not None and not any(map(bags_at, chain(paths, *below))):
            raise InputError("--topic", "no bag is named to which it could apply", "Leave it out.")
        if not any(below):
            return Frames(self._named(paths))
        frames: list[Frame] = []
        for path, found in zip(paths, below, strict=True):
            if found:
                frames += self._below(path, found)
            else:
                frames += self._named([path], several=len(paths) > 1)
        return Frames(frames)

    def _below(self, folder: Path, found: Sequence[Path]) -> Iterator[Frame]:
        """The scans of the recordings in a folder; their keys begin with the recording's path."""
        for path in found:
            place = path.relative_to(folder)
            if is_bag(path):
                name = place.with_name(stem(path)).as_posix()
                for frame in self._clouds_of_found(path, name):
                    yield replace(frame, sequence=name)
            else:
                name = place.as_posix()
                for frame in self._named([path]):
                    yield replace(frame, sequence=name, key=f"{name}/{frame.key}")

    def _named(self, paths: Sequence[Path], several: bool = False) -> list[Frame]:
        """The scans at paths that are not folders of recordings.

        Args:
            paths: The paths.
            several: True if there are other paths besides.
        """
        found = [scans_or_bags(path, self.layouts) for path in paths]
        scans = [scan for scans_at_path, _ in found for scan in scans_at_path]
        # A data set's scans lie in several folders, those of any other path in one.
        has_data_set = any(_several_folders(scans_at_path) for scans_at_path, _ in found)
        key_is_path = has_data_set or (self.recordings and _several_folders(scans))
        label_path = partial(label_of, layouts=self.layouts) if self.labelled else lambda _: None
        keys = relative_keys(scans) if key_is_path else None
        files = iter(frames_of(scans, label_path, self.columns, keys))
        several = several or len(paths) > 1 or any(len(bags) > 1 for _, bags in found)
        frames: list[Frame] = []
        for path, (scans_at_path, bags) in zip(paths, found, strict=True):
            frames += islice(files, len(scans_at_path))
            for bag in bags:
                clouds_of = self._clouds if bag == path else self._clouds_of_found
                frames += clouds_of(bag, _bag_name(bag) if several else "")
        return frames

    def _clouds_of_found(self, bag: Path, prefix: str) -> Sequence[Frame]:
        """The clouds of a bag in a folder, which must not stop the others where it fails."""
        try:
            return self._clouds(bag, prefix)
        except InputError as error:
            key = prefix or stem(bag)
            return [UnreadableBag(key=key, sequence=stem(bag), path=bag, error=error)]

    def _clouds(self, bag: Path, prefix: str) -> Sequence[Frame]:
        """The clouds of a bag, or those at a path into one."""
        if self.topic is not None and is_bag(bag):
            bag /= self.topic.strip("/")
        return self.frames_of_bag(bag, self.labelled, prefix)


def source_of(
    scans: GivenScans,
    columns: Sequence[str] = DEFAULT_COLUMNS,
    results: Sequence[Path | str] = (),
) -> Source:
    """The source of the scans that a program passes, with their labels.

    Args:
        scans: A source; or one or more scans in memory, frames, files and folders of scans, or URLs
            of files and folders.
        columns: Names of the columns of files that do not name them.
        results: Folders or URLs of results, which are passed over in a folder of recordings.

    Raises:
        InputError: No scans, an object of another type, a path that does not exist, or a folder
            without scans.
    """
    if isinstance(scans, Source):
        return scans
    given: Iterable[object]
    given = [scans] if isinstance(scans, Scan | Frame | str | Path) else scans
    here = [Path(folder) for folder in results if not is_url(folder)]
    frames: list[Frame] = []
    # Files are taken together, for only then those of one folder are a recording.
    for kind, group in groupby(enumerate(given), lambda numbered: _kind_of(numbered[1])):
        numbers, items = zip(*group, strict=True)
        if kind == "url":
            from derain.sources.store_listing import frames_at

            frames += frames_at(items, columns, results=results)
        elif kind == "path":
            frames += named_frames(items, columns, labelled=True, results=here)
        else:
            frames += map(_frame_in_memory, numbers, items)
    if not frames:
        raise InputError("scans", "there are none", "Give one or more.")
    return Frames(frames)


def _kind_of(item: object) -> str:
    """What an item that a program passes is: a ``url``, a ``path``, or an ``object``."""
    if isinstance(item, str | Path):
        return "url" if is_url(item) else "path"
    return "object"


def _frame_in_memory(place: int, item: object) -> Frame:
    """The frame of a scan in memory, or the frame that is passed; errors as for `source_of`."""
    match item:
        case Frame():
            return item
        case Scan():
            return MemoryFrame(key=f"{place:06d}", number=place, scan=item)
    reason = f"{type(item).__name__} is no scan"
    raise InputError("scans", reason, "Give Scans, or paths of files and folders.")


def frame_of(
    scan: Path, columns: Sequence[str] = DEFAULT_COLUMNS, layouts: Sequence[Layout] | None = None
) -> FileFrame:
    """The frame of one file, with its labels if there are any. A missing file raises when read.

    Args:
        scan: The file, or a path into a bag, which stands for its first cloud.
        columns: Names of its columns, if the file does not name them.
        layouts: Layouts by which to find its labels; by default those of the packaged data cards.

    Raises:
        InputError: A bag that cannot be read.
    """
    if split(scan) is not None:
        return bag_frames(scan, labelled=True)[0]
    frame = frames_of([scan], partial(label_of, layouts=layouts), columns)[0]
    assert isinstance(frame, FileFrame)
    return frame


def frames_of(
    scans: Sequence[Path],
    label_path: Callable[[Path], Path | None],
    columns: Sequence[str],
    keys: Sequence[str] | None = None,
) -> Frames:
    """Frames of files; the files of one folder are a sequence.

    Args:
        scans: The files, in order.
        label_path: Returns the file of a scan's labels; None to read no labels.
        columns: Names of the columns of files that do not name them.
        keys: Keys of the frames; None takes the stems of the files.
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


def relative_keys(scans: Sequence[Path]) -> list[str]:
    """Paths without suffixes, relative to the common parent folder of all scans."""
    if not scans:
        return []
    places = [Path(os.path.abspath(scan)) for scan in scans]
    root = os.path.commonpath([place.parent for place in places])
    relative = (place.relative_to(root) for place in places)
    return [path.with_name(scan_stem(path)).as_posix() for path in relative]


def _bag_name(bag: Path) -> str:
    """The name of a bag that a path leads into, without its suffix."""
    found = split(bag)
    assert found is not None
    return stem(found[0])


def _several_folders(scans: Iterable[Path]) -> bool:
    return len({scan.parent for scan in scans}) > 1
