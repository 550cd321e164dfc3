"""Scans of a data set one by one: read, augmented and viewed."""

from collections.abc import Callable, Iterator, Sequence
from dataclasses import replace
from typing import Any

from torch.utils.data import DataLoader, Dataset

from derain.cards.card import DataCard
from derain.datamodules.augmentation import Augmentation
from derain.datamodules.kept import Kept
from derain.datamodules.order import Pick
from derain.datamodules.windows import seen
from derain.errors import InputError
from derain.learning.batch import READ, VIEW, Batch, Sample, added_up
from derain.learning.seeds import Draw, generator_of
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.sources.spread import evenly_spaced
from derain.system.stopwatch import Stopwatch
from derain.views.view import View


class ScanDataset(Dataset[Sample | InputError]):
    """Reads the scans of frames and views them.

    What no epoch changes is kept from one to the next: of scans that are augmented what was read,
    of others their views, too. A file that changes meanwhile is not read again.

    Args:
        frames: The frames.
        read: Reads the scan of one of them, as the network is to see it.
        view: What the network sees.
        reader: Reads scans as they are, and has the data card that says which labels are rain.
        augmentation: Changes each scan anew every epoch; None leaves them as they are.
        seed: Seed of the run; with the epoch and the scan it says how that scan is changed.
        room: Bytes that may be kept; each worker, which has a copy of the data set, keeps as many.
    """

    def __init__(
        self,
        frames: Sequence[Frame],
        read: Callable[[Frame], Scan],
        view: View,
        reader: FrameReader,
        augmentation: Augmentation | None = None,
        seed: int = 0,
        room: int = 0,
    ) -> None:
        self.frames = frames
        self.read = read
        self.view = view
        self.reader = reader
        self.augmentation = augmentation
        self.seed = seed
        self._scans = Kept[Scan](room)
        self._samples = Kept[Sample](room)

    @property
    def card(self) -> DataCard:
        """Says which labels are rain."""
        return self.reader.card

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
        """Reads some of the scans, spread over all of them, as they are in their files.

        Args:
            most: How many, where there are so many.

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
                made = self._samples.get(number, lambda: self._viewed(read(), number, stopwatch))
            else:
                scan = self._scans.get(number, read)
                # The first time is drawn as where there is no second one.
                drawn = (number, pick.again) if pick.again else (number,)
                generator = generator_of(Draw.AUGMENTATION, self.seed, pick.epoch, *drawn)
                scan = self.augmentation(scan, generator, self.view.azimuth)
                made = self._viewed(scan, number, stopwatch)
        # Of a sample that was kept, what this epoch took, which is next to nothing.
        return replace(made, measured=pick.measured, milliseconds=stopwatch.milliseconds)

    def _viewed(self, scan: Scan, number: int, stopwatch: Stopwatch) -> Sample:
        def read_around(frame: Frame) -> Scan:
            with stopwatch.stage(READ):
                return self.reader.read_unlabelled(frame)

        view = seen(self.view, scan, self.frames, number, read_around)
        return Sample.of(scan, view, self.card, key=self.frames[number].key)


class LateLoader(DataLoader[Sample | InputError]):
    """Starts to read when the first batch is asked for, and raises what went wrong in a worker.

    Lightning makes the iterators of a run that goes on from a checkpoint before it tells the epoch,
    and workers read ahead as soon as there is an iterator.
    """

    def __iter__(self) -> Any:
        for batch in super().__iter__():
            if isinstance(batch, InputError):
                raise batch
            yield batch


def packed(samples: Sequence[Sample | InputError]) -> Batch | InputError:
    """One batch of samples, or the first error among them."""
    for error in samples:
        if isinstance(error, InputError):
            return error
    stopwatch = Stopwatch()
    with stopwatch.stage(VIEW):
        batch = Batch.of([sample for sample in samples if isinstance(sample, Sample)])
    return replace(batch, milliseconds=added_up([batch.milliseconds, stopwatch.milliseconds]))
