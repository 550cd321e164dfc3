"""Lists the scans and bags at URLs, by the rules for folders of this machine.

The objects are listed once. Empty files at the same paths in a temporary folder then show what
layout they have; only what lies beside the scans is fetched: times, poses, metadata of bags.
"""

from collections.abc import Callable, Iterable, Sequence
from itertools import chain
from pathlib import Path
from typing import TypeVar

from derain.bags.names import BAG_METADATA, files_of, split, stem
from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS, RECORDS
from derain.jobs.job import FOLDER, JOB
from derain.sources.file_frame import FileFrame
from derain.sources.folders import FrameFinder, named_frames
from derain.sources.frame import Frame
from derain.sources.source import Frames
from derain.sources.stored_frame import StoredBag, StoredScan
from derain.stores.mirror import Mirror, mirror
from derain.stores.objects import StoredObject, listed
from derain.stores.url import Place, is_url, without_secrets
from derain.system.notices import changed_warnings

# Files that are fetched to list scans and bags, or for the times and poses of scans.
READ_WHEN_LISTED = (*RECORDS, BAG_METADATA)

Value = TypeVar("Value")


def frames_at(
    places: Iterable[Place],
    columns: Sequence[str] = DEFAULT_COLUMNS,
    topic: str | None = None,
    results: Iterable[Place] = (),
) -> Frames:
    """The scans at paths or URLs; those at URLs are without labels.

    Args:
        places: As :func:`~derain.sources.folders.named_frames` takes them, all of them paths or all
            of them URLs.
        columns: Names of the columns of files that do not name them.
        topic: Topic of the bags among them; None if they have only one of clouds.
        results: Folders or URLs of results, which are skipped in a folder of recordings.

    Raises:
        InputError: As :func:`~derain.sources.folders.named_frames` raises it; a store that cannot
            be reached.
    """
    places = list(places)
    urls = [str(place) for place in places if is_url(place)]
    if not urls:
        here = tuple(Path(folder) for folder in results if not is_url(folder))
        return named_frames(map(Path, places), columns, topic=topic, results=here)
    if len(urls) < len(places):
        other = next(place for place in places if not is_url(place))
        raise InputError(
            without_secrets(urls[0]),
            f"is in a store, and {other} is not",
            "Clean them by two commands.",
        )
    with mirror() as local, changed_warnings(local.with_urls):
        listing = _Listing(local, (stored for url in urls for stored in listed(url)))
        stored = tuple(local.path_of(str(folder)) for folder in results if is_url(folder))
        finder = FrameFinder(columns, topic=topic, results=stored, frames_of_bag=listing.bag)
        return finder.frames([local.path_of(url) for url in urls]).map(listing.stored)


class _Listing:
    """Objects of stores, and a mirror with their paths.

    Args:
        local: An empty mirror.
        objects: The objects. Hidden ones are skipped, except the file that marks a folder with
            records of a job.
    """

    def __init__(self, local: Mirror, objects: Iterable[StoredObject]) -> None:
        self._local = local
        self._stamps: dict[Path, str] = {}
        stored = [(each.path, each) for each in objects]
        self._objects = {path: each for path, each in stored if not _is_hidden(path)}
        read = {path for path in self._objects if path.name in READ_WHEN_LISTED}
        jobs = (path for path, _ in stored if path.match(f"{FOLDER}/{JOB}"))
        local.mark(chain((path for path in self._objects if path not in read), jobs))
        local.fetch(self._objects[path] for path in read)

    def bag(self, path: Path, labelled: bool, prefix: str) -> list[Frame]:
        """The bag that a path of the mirror leads into, as one frame."""
        found = split(path)
        assert found is not None
        place, inner = found
        bag = place.relative_to(self._local.root)
        files = [file.relative_to(self._local.root) for file in files_of(place)]
        return [
            StoredBag(
                key=prefix or stem(bag),
                sequence=stem(bag),
                path=bag,
                objects=tuple(self._objects[file] for file in files),
                inner=inner,
                prefix=prefix,
            )
        ]

    def stored(self, frame: Frame) -> Frame:
        """A frame of the mirror as one of its store, for which the mirror is not needed."""
        if isinstance(frame, StoredBag):
            return frame
        assert isinstance(frame, FileFrame)
        path = frame.path.relative_to(self._local.root)
        return StoredScan(
            key=frame.key,
            sequence=frame.sequence,
            number=frame.number,
            path=path,
            columns=frame.columns,
            objects=(self._objects[path],),
            recorded_time=self._recorded(lambda: frame.time),
            recorded_pose=self._recorded(lambda: frame.pose),
            records_stamp=self._stamp(path.parent),
        )

    def _stamp(self, folder: Path) -> str:
        """Sizes and versions of the records of the scans in a folder."""
        if folder not in self._stamps:
            places = (place / name for place in (folder, folder.parent) for name in RECORDS)
            there = (self._objects[place] for place in places if place in self._objects)
            self._stamps[folder] = " ".join(each.stamp for each in there)
        return self._stamps[folder]

    def _recorded(self, value: Callable[[], Value]) -> Value | InputError:
        """The content of a record, or the error of a damaged one."""
        try:
            return value()
        except InputError as error:
            return self._local.error_with_urls(error)


def _is_hidden(path: Path) -> bool:
    return any(part.startswith(".") for part in path.parts)
