"""From a source of frames to batches of views."""

from collections.abc import Iterator, Sequence

import lightning
from torch.utils.data import DataLoader

from derain.cards.card import DataCard
from derain.datamodules.loader import scan_loader
from derain.datamodules.order import Draws
from derain.datamodules.scan_data import Loading, Part, ScanData, with_needed_labels
from derain.datamodules.statistics import with_statistics
from derain.errors import InputError
from derain.learning.batch import Sample
from derain.learning.task import Task
from derain.scan import Scan
from derain.sources.reader import FrameReader
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.sources.training_record import record_of_scans

__all__ = ["Loading", "Part", "ScanDataModule"]

# Training scans that statistics are measured on.
MOST_MEASURED = 200


class ScanDataModule(ScanData, lightning.LightningDataModule):
    """Batches of views of scans, for training, validation, test and prediction.

    A data set returns its scans by part; all else is the same for every data set.

    Args:
        card: Data card of the scans; statistics it lacks are taken from the training scans.
        loading: How the scans are read and batched.

    Attributes:
        task: What model and data agreed on before training; None before that.
    """

    def __init__(self, card: DataCard, loading: Loading) -> None:
        lightning.LightningDataModule.__init__(self)
        ScanData.__init__(self, card, loading)
        self.task: Task | None = None

    def epoch_source(self, part: Part) -> Source:
        """The scans that a loader of a part passes through: by default, each of them once.

        Raises:
            InputError: Missing folders or scans.
        """
        return self.source(part)

    def draws(self) -> Draws | None:
        """Which training scans an epoch draws; None, the default, draws each once.

        Raises:
            InputError: Missing folders or scans.
        """
        return None

    def complete_card(self, columns: Sequence[str] = (), labelled: bool = True) -> None:
        """Measures the statistics that the data card lacks, on the training scans.

        Args:
            columns: Columns besides the usual ones that need statistics.
            labelled: Whether labels are read, from which the share of rain is measured.

        Raises:
            InputError: A scan that cannot be read, or a column that none of them has.
        """
        extra = [name for name in columns if name not in self.card.extra]
        if extra or not self.card.has_statistics:
            scans = self.training_scans(MOST_MEASURED, columns, labelled)
            self.card = with_statistics(self.card, scans, extra)

    def training_scans(
        self, most: int, columns: Sequence[str] | None = None, labelled: bool = True
    ) -> Iterator[Scan]:
        """Reads some of the training scans, spread evenly, as they are in their files.

        Args:
            most: How many at most.
            columns: Which columns to keep besides the usual ones; None keeps all.
            labelled: Whether their labels are read.

        Raises:
            InputError: A scan or labels that cannot be read.
        """
        frames = with_needed_labels(self.source("train"), "train", labelled)
        reader = FrameReader(self.card, self.loading.intensity_scale, columns)
        return map(reader.read, evenly_spaced(frames, most))

    def training_record(self) -> dict[str, tuple[str, ...]]:
        """The training scans, as the Spec of a model that is trained on them records them."""
        return record_of_scans(self.source("train"))

    def train_dataloader(self) -> DataLoader[Sample | InputError]:
        """Training scans, in a new order and newly augmented every epoch."""
        return self._loader("train")

    def val_dataloader(self) -> DataLoader[Sample | InputError]:
        """Validation scans, in order."""
        return self._loader("validation")

    def test_dataloader(self) -> DataLoader[Sample | InputError]:
        """Test scans, in order."""
        return self._loader("test")

    def predict_dataloader(self) -> DataLoader[Sample | InputError]:
        """All rows of the test scans, with or without labels."""
        return self._loader("predict")

    def _loader(self, part: Part) -> DataLoader[Sample | InputError]:
        if self.task is None:
            raise InputError("the model", "has not been trained", "Give a checkpoint: --ckpt_path.")
        processes, process = 1, 0
        if self.trainer is not None:
            processes, process = self.trainer.world_size, self.trainer.global_rank
        draws = self.draws() if part == "train" else None
        shown = self.epoch_source(part)
        return scan_loader(shown, part, self.task, self.loading, processes, process, draws)

    @property
    def _reads_labels(self) -> bool:
        return self.task is None or self.task.reads_labels

    @property
    def _reader(self) -> FrameReader:
        columns = None if self.task is None else self.task.columns
        return FrameReader(self.card, self.loading.intensity_scale, columns)
