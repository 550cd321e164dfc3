"""Reads, augments and views the scans of a data set one by one, and keeps what stays the same."""

import pickle
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass, replace
from typing import Any, TypeVar

from torch.utils.data import Dataset

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.order import Pick
from derain.errors import InputError
from derain.learning.batch import READ, VIEW, Sample
from derain.learning.seeds import Draw, generator_of
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.sources.spread import evenly_spaced
from derain.system.stopwatch import Stopwatch
from derain.views.view import View

Item = TypeVar("Item", Scan, Sample)

MEGABYTE = 2**20


@dataclass(eq=False)
class ScanDataset(Dataset[Sample | InputError]):
    """Reads the scans of frames and views them.

    What stays the same is kept from epoch to epoch: the read scan where it is augmented, else its
    view. A file that changes meanwhile is not read again.

    Attributes:
        frames: The frames.
        read: Reads the scan of a frame, as the network sees it.
        view: The network's view.
        reader: Reads scans as they are in their files; its data card names the labels of rain.
        augmentation: Changes each scan newly every epoch; None changes nothing.
        seed: Seed of the run; with epoch and scan it determines the augmentation.
        room: Bytes that may be kept; each worker has a copy of the data set and keeps as many.
    """

    frames: Sequence[Frame]
    read: Callable[[Frame], Scan]
    view: View
    reader: FrameReader
    augmentation: Augmentation | None = None
    seed: int = 0
    room: int = 0

    def __post_init__(self) -> None:
        self._kept = Cache(self.room)

    def __len__(self) -> int:
        return len(self.frames)

    def __getitem__(self, pick: Pick | int) -> Sample | InputError:
        # What a worker raises becomes a RuntimeError with a traceback in the training process;
        # what it returns crosses as it is, and is raised there.
        try:
            # Lightning's --trainer.overfit_batches brings its own order: numbers alone.
            return self._sample(pick if isinstance(pick, Pick) else Pick(pick))
        except InputError as error:
            return error

    def scans(self, most: int) -> Iterator[Scan]:
        """Reads some of the scans, spread evenly, as they are in their files.

        Args:
            most: The largest number.

        Raises:
            InputError: A scan that cannot be read.
        """
        return map(self.reader.read, evenly_spaced(self.frames, most))

    def _sample(self, pick: Pick) -> Sample:
        stopwatch, number, frame = Stopwatch(), pick.number, self.frames[pick.number]

        def read() -> Scan:
            with stopwatch.stage(READ):
                return self.read(frame)

        with stopwatch.stage(VIEW):
            if self.augmentation is None:
                made = self._kept.get(number, lambda: self._viewed(read(), number))
            else:
                scan = self._kept.get(number, read)
                # A scan that is drawn once is augmented the same, whether or not others repeat.
                drawn = (number, pick.again) if pick.again else (number,)
                generator = generator_of(Draw.AUGMENTATION, self.seed, pick.epoch, *drawn)
                card = self.reader.card
                scan = self.augmentation(scan, generator, self.view.azimuth, card.rain)
                made = self._viewed(scan, number)
        # A kept sample took next to no time in this epoch.
        return replace(made, measured=pick.measured, milliseconds=stopwatch.milliseconds)

    def _viewed(self, scan: Scan, number: int) -> Sample:
        return Sample.of(scan, self.view(scan), self.reader.card, key=self.frames[number].key)


class Cache:
    """Items by number, from the first on as many as fit into memory.

    The first items stay. Every epoch needs each item once: a cache that evicted the oldest would
    have evicted each item before its next use.

    Args:
        room: Bytes that all items together may fill.
    """

    def __init__(self, room: int) -> None:
        self._left = room
        self._items: dict[int, Any] = {}

    def get(self, number: int, make: Callable[[], Item]) -> Item:
        """The item of a number, made where it is not kept."""
        if number in self._items:
            return self._items[number]
        made = make()
        if self._left > 0:  # none after the first that does not fit is measured
            self._left -= len(pickle.dumps(made, pickle.HIGHEST_PROTOCOL))
            if self._left >= 0:
                self._items[number] = made
        return made
