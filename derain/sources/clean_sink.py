"""Scans without their rain: files in a folder, and rewritten bags."""

import os
from collections.abc import Callable, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import asdict, dataclass
from functools import partial
from pathlib import Path
from typing import Self

from derain.errors import InputError
from derain.files import write_scan
from derain.files.atomic import require_writable_folder
from derain.files.columns import with_column
from derain.files.format import format_of
from derain.files.labels import LABEL
from derain.sources.bag_frame import BagFrame
from derain.sources.cleaned_bags import RAIN_PROBABILITY, BagOptions, CleanedBags
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.search import mark_as_results
from derain.sources.sink import FolderSink
from derain.sources.source import Source
from derain.sources.stored_frame import StoredBag
from derain.stores.mirror import uploaded
from derain.stores.objects import stamps_at
from derain.stores.url import Place, is_url, is_web, path_of, url_of, without_secrets


class CleanSink:
    """Writes the scans of a source without their rain, and their labels (1 = rain).

    A bag is written anew if all its clouds are in the source. The sink is a context manager: a bag
    is in its place once its last cloud is written, and the last bag at the end of the block.

    Example:
        >>> source = derain.named_frames("scan.bin")
        >>> with derain.CleanSink("cleaned", source, removed="rain") as sink:
        ...     report = derain.clean(source, derain.FilterDerainer(derain.DROR()), sink)
        >>> len(derain.read_scan("rain/scan.bin"))
        20

    Args:
        folder: Folder to write to, made if missing; or a URL, to which a run in units writes.
        source: The scans.
        removed: Folder for the removed points of files; None leaves them out.
        probability: True if the written scans have the column ``rain_probability``.
        bags: Options for the clouds of bags.

    Raises:
        InputError: The folder holds files that must not be overwritten, two scans have one name, or
            options that contradict each other or the scans; in the block, a folder that cannot be
            written.

    Attributes:
        folder: Folder to write to, or the path that stands for its URL.
        destination: Opens an equal sink for other scans in any process.
        options: Options, true, false or a name each.
    """

    def __init__(
        self,
        folder: Path | str,
        source: Source,
        *,
        removed: Path | str | None = None,
        probability: bool = False,
        bags: BagOptions = BagOptions(),
    ) -> None:
        sink = partial(CleanSink, probability=probability, bags=bags)
        self.destination = Destination(folder, removed, sink)
        self.folder = _path_of(folder)
        self.probability = probability
        self.options = {"removed": removed is not None, "probability": probability, **asdict(bags)}
        self._source = source
        self._files = FolderSink(self.folder)
        self._removed = None if removed is None else FolderSink(_path_of(removed), "--removed")
        stored = (frame for frame in source if isinstance(frame, StoredBag))
        self._stored_bags: dict[Frame, Path] = {}
        for bag in stored:
            target = self._stored_bags[bag] = self.folder / bag.written_path
            if target in (bag.path, bag.path.parent) or target.is_relative_to(bag.path):
                raise InputError(
                    url_of(self.folder), f"would overwrite {bag.name}", "Give --out another folder."
                )
        self._files.refuse_clashes(source)
        self._bags = CleanedBags(self.folder, source, bags, probability)
        self._refuse_files_in_bags()
        if probability:
            self._refuse_nameless()
        if self._removed is not None:
            self._refuse_removed(self._removed)

    def __enter__(self) -> Self:
        for sink in filter(None, (self._files, self._removed)):
            require_writable_folder(sink.folder)
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        self._bags.end(failed=kind is not None)
        for sink in filter(None, (self._files, self._removed)):
            if sink.folder.is_dir() and self._is_among_scans(sink.folder):
                mark_as_results(sink.folder)

    def targets(self) -> Iterator[Path]:
        """Every file and bag that it may write."""
        yield from (*self._stored_bags.values(), *self._bags.targets())
        for frame in self._source:
            if not self._is_in_bag(frame):
                yield from (self._files.scan_path(frame), self._files.path(frame, LABEL))
                if self._removed is not None:
                    yield self._removed.scan_path(frame)

    def write(self, judgement: Judgement) -> None:
        """Writes a scan without its rain.

        Args:
            judgement: The scan, judged; scans of a bag come in the order of the bag.

        Raises:
            InputError: It cannot be written, or the folder is a URL: :func:`derain.clean` opens a
                sink for each unit, whose files are uploaded together.
        """
        if self.destination.is_stored:
            raise InputError(
                url_of(self.folder), "is written to in units", "Give the sink to derain.clean."
            )
        frame, rain = judgement.frame, judgement.rain
        assert frame is not None
        if self._bags.takes(frame):
            self._bags.write(judgement)
            return
        scan = judgement.scan
        if self.probability:
            scan = with_column(scan, RAIN_PROBABILITY, judgement.probability)
        if self._removed is not None:
            write_scan(self._removed.scan_path(frame), scan.take(rain))
        self._files.write(frame, scan.take(~rain), rain)

    def finish_bags(self, given: Sequence[Frame]) -> Iterator[tuple[Frame, InputError]]:
        """Puts the last bag in its place, unless clouds of it may follow.

        Args:
            given: The scans that were given to it.

        Yields:
            Every cloud of the bags that could not be written, and why.
        """
        if len(given) < len(self._source):
            return
        broken = self._bags.finish()
        for frame in self._source:
            if isinstance(frame, BagFrame) and frame.clouds in broken:
                yield frame, broken[frame.clouds]

    def _is_among_scans(self, folder: Path) -> bool:
        """True if a folder without scans of its own lies where scans were searched for."""
        place = folder.absolute()
        frames = [frame for frame in self._source if isinstance(frame, FileFrame)]
        scans = [frame.path.absolute() for frame in frames]
        if not scans or any(scan.is_relative_to(place) for scan in scans):
            return False
        roots = {Path(os.path.commonpath(scans))}
        for frame, scan in zip(frames, scans, strict=True):
            # The key of a scan in a recording is its path from the folder that was searched.
            if depth := frame.key.count("/"):
                roots.add(scan.parents[: depth + 1][-1])
        return any(place.is_relative_to(root) for root in roots)

    def _is_in_bag(self, frame: Frame) -> bool:
        return frame in self._stored_bags or self._bags.takes(frame)

    def _refuse_removed(self, removed: FolderSink) -> None:
        """Refuses a folder of removed points where they are in bags, or would take a place."""
        if os.path.realpath(removed.folder) == os.path.realpath(self.folder):
            reason = "--removed is the folder of --out, where the cleaned scans go"
            raise InputError(url_of(removed.folder), reason, "Give it another one.")
        for frame in self._source:
            if self._is_in_bag(frame):
                reason = f"is a folder for files, and {frame.name} is in a bag"
                raise InputError("--removed", reason, "Give --removed-topic NAME.")
            if isinstance(frame, FileFrame):
                removed.refuse_own_scan(frame)

    def _refuse_nameless(self) -> None:
        """Refuses a file in which the column of probabilities would have no name."""
        for frame in self._source:
            if frame.suffix and not format_of(Path(frame.name)).NAMES_COLUMNS:
                raise InputError(
                    frame.name,
                    f"the columns of such a file have no names, so none can be {RAIN_PROBABILITY}",
                    "Leave --probability out, or convert the scans, to .pcd or .npz for instance.",
                )

    def _refuse_files_in_bags(self) -> None:
        """Refuses a scan in a file whose result would be in the folder of a bag's copy."""
        bags = {*self._stored_bags.values(), *self._bags.targets()}
        if not bags:
            return
        for frame in self._source:
            folders = () if self._is_in_bag(frame) else self._files.scan_path(frame).parents
            for bag in bags.intersection(folders):
                raise InputError(
                    frame.name,
                    f"its result would be in {url_of(bag)}, where a bag of that name is written",
                    "Take them in two runs, each to its --out.",
                )


@dataclass(frozen=True)
class Destination:
    """The folders in which scans are written without their rain, and the sinks that do it.

    Attributes:
        folder: The folder, a path or a URL.
        removed: Folder for the removed points of files, a path or a URL; None leaves them out.
        sink: Makes a sink of a folder, scans, and a folder for their removed points.
    """

    folder: Place
    removed: Place | None
    sink: Callable[..., CleanSink]

    @property
    def is_stored(self) -> bool:
        """True if it is in an object store, even in part."""
        return is_url(self.folder) or is_url(self.removed)

    @contextmanager
    def opened(self, source: Source) -> Iterator[tuple[CleanSink, dict[str, str]]]:
        """Lends a sink; its files are in their place after the block ends without an error.

        Args:
            source: The scans.

        Yields:
            The sink; and the sizes and versions of the uploaded files, by path, after the block.

        Raises:
            InputError: A folder or a store that cannot be written, or what CleanSink refuses.
        """
        stamps: dict[str, str] = {}
        with ExitStack() as stack:
            folder = stack.enter_context(uploaded(self.folder, stamps))
            removed = None
            if self.removed is not None:
                removed = stack.enter_context(uploaded(self.removed, stamps))
            yield stack.enter_context(self.sink(folder, source, removed=removed)), stamps

    def stamps(self) -> dict[str, str]:
        """Sizes and versions of the results in stores, by path.

        Raises:
            InputError: A store that cannot be reached.
        """
        urls = [str(place) for place in (self.folder, self.removed) if is_url(place)]
        return {path: stamp for url in urls for path, stamp in stamps_at(url).items()}

    def holds(self, source: Source) -> bool:
        """True if all result files of the scans exist; files in stores are not checked.

        Args:
            source: The scans.
        """
        if is_url(self.folder) and (self.removed is None or is_url(self.removed)):
            return True
        sink = self.sink(self.folder, source, removed=self.removed)
        return all(path.exists() or is_url(url_of(path)) for path in sink.targets())


def _path_of(place: Place) -> Path:
    """The path of a folder, or the one that stands for its URL.

    Raises:
        InputError: It is on a web server.
    """
    if is_web(place):
        raise InputError(
            without_secrets(str(place)),
            "a web server cannot store results",
            "Name a folder, or a URL such as s3://bucket/cleaned.",
        )
    return path_of(str(place)) if is_url(place) else Path(place)
