"""Scans of a data set one by one: read, augmented and viewed."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from torch.utils.data import DataLoader, Dataset

from derain.cards.card import DataCard
from derain.datamodules.augmentation import Augmentation
from derain.datamodules.order import Pick
from derain.errors import InputError
from derain.learning.batch import Batch, Sample
from derain.learning.seeds import Draw, generator_of
from derain.scan import Scan
from derain.views.view import View


@dataclass(frozen=True)
class ScanFile:
    """Where one scan lies, and where its labels are to be read, if they are."""

    scan: Path
    label: Path | None = None


class ScanDataset(Dataset[Sample | InputError]):
    """Reads scans and views them.

    Args:
        files: The scans.
        read: Reads one of them.
        view: What the network sees.
        card: Data card that says which labels are rain.
        augmentation: Changes each scan anew every epoch; None leaves them as they are.
        seed: Seed of the run; with the epoch and the scan it says how that scan is changed.
    """

    def __init__(
        self,
        files: Sequence[ScanFile],
        read: Callable[[ScanFile], Scan],
        view: View,
        card: DataCard,
        augmentation: Augmentation | None = None,
        seed: int = 0,
    ) -> None:
        self.files = files
        self.read = read
        self.view = view
        self.card = card
        self.augmentation = augmentation
        self.seed = seed

    def __len__(self) -> int:
        return len(self.files)

    def __getitem__(self, pick: Pick | int) -> Sample | InputError:
        # What a worker raises becomes a RuntimeError with a traceback in the training process;
        # what it returns crosses as it is, and is raised there.
        try:
            # Lightning's --trainer.overfit_batches brings its own order: numbers alone.
            return self._sample(pick if isinstance(pick, Pick) else Pick(pick))
        except InputError as error:
            return error

    def _sample(self, pick: Pick) -> Sample:
        scan = self.read(self.files[pick.number])
        if self.augmentation is not None:
            generator = generator_of(Draw.AUGMENTATION, self.seed, pick.epoch, pick.number)
            scan = self.augmentation(scan, generator, self.view.azimuth)
        return Sample.of(scan, self.view(scan), self.card, pick.measured)


class LateLoader(DataLoader[Sample | InputError]):
    """Starts to read when the first batch is asked for.

    Lightning makes the iterators of a run that goes on from a checkpoint before it tells the epoch,
    and workers read ahead as soon as there is an iterator.
    """

    def __iter__(self) -> Any:
        yield from super().__iter__()


def packed(samples: Sequence[Sample | InputError]) -> Batch | InputError:
    """One batch of samples, or the first error among them."""
    for error in samples:
        if isinstance(error, InputError):
            return error
    return Batch.of([sample for sample in samples if isinstance(sample, Sample)])
