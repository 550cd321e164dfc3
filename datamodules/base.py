"""From a source of frames to batches of views."""

from collections.abc import Iterable, Iterator, Sequence

import lightning
import numpy as np
from torch.utils.data import DataLoader

from derain.cards.card import DataCard
from derain.datamodules.loader import scan_loader
from derain.datamodules.order import Draws
from derain.datamodules.scan_data import Loading, Part, ScanData, with_needed_labels
from derain.errors import InputError
from derain.learning.batch import Sample
from derain.scan import Scan
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.sources.training_record import record_of_scans
from derain.views.channels import USUAL_CHANNELS, channel_values

__all__ = ["Loading", "Part", "ScanDataModule"]

# Training scans that statistics are measured on.
MOST_MEASURED = 200

# A variance below this share of the squared mean is what rounding leaves of a constant.
ROUNDING = 1e-12


class ScanDataModule(ScanData, lightning.LightningDataModule):
    """Batches of views of scans, for training, validation, test and prediction.

    A data set returns its scans by part; all else is the same for every data set.

    Args:
        card: Data card of the scans; statistics it lacks are taken from the training scans.
        loading: Options for reading and batching scans.

    Attributes:
        task: Agreement of model and data before training; None before that.
    """

    def __init__(self, card: DataCard, loading: Loading) -> None:
        lightning.LightningDataModule.__init__(self)
        ScanData.__init__(self, card, loading)

    def epoch_source(self, part: Part) -> Source:
        """The scans that a loader of a part passes through: by default, each of them once.

        Raises:
            InputError: Missing folders or scans.
        """
        return self.source(part)

    def draws(self) -> Draws | None:
        """The training scans that an epoch draws; None, the default, draws each once.

        Raises:
            InputError: Missing folders or scans.
        """
        return None

    def complete_card(self, columns: Sequence[str] = (), labelled: bool = True) -> None:
        """Measures the statistics that the data card lacks, on the training scans.

        Args:
            columns: Columns besides the usual ones that need statistics.
            labelled: True if labels are read, from which the share of rain is measured.

        Raises:
            InputError: A scan that cannot be read, or a column that none of them has.
        """
        extra = [name for name in columns if name not in self.card.moments]
        if extra or not self.card.has_statistics:
            scans = self.training_scans(MOST_MEASURED, columns, labelled)
            self.card = with_statistics(self.card, scans, extra)

    def training_scans(
        self, most: int, columns: Sequence[str] | None = None, labelled: bool = True
    ) -> Iterator[Scan]:
        """Reads some of the training scans, spread evenly, as they are in their files.

        Args:
            most: The largest number.
            columns: Columns to keep besides the usual ones; None keeps all.
            labelled: True if their labels are read.

        Raises:
            InputError: A scan or labels that cannot be read.
        """
        frames = with_needed_labels(self.source("train"), "train", labelled)
        reader = self.loading.reader(self.card, columns)
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


def with_statistics(card: DataCard, scans: Iterable[Scan], extra: Sequence[str] = ()) -> DataCard:
    """Completes a data card with the statistics that it lacks.

    Mean and standard deviation of x, y, z and range in metres, of intensity and of extra channels,
    over the valid points of all scans; 0 and 1 for a channel without values. The share of rain is
    that among the points of known class; it is not measured where a scan has no labels.

    Args:
        card: A data card.
        scans: Training scans.
        extra: Names of further channels.

    Raises:
        InputError: An extra channel without any value.
    """
    channels = (*USUAL_CHANNELS, *extra)
    count, total, squares = np.zeros((3, len(channels)))
    rain, judged, labelled = 0, 0, True
    for scan in scans:
        rows = np.flatnonzero(scan.valid)
        values = channel_values(scan, rows, channels).astype(np.float64)
        count += (~np.isnan(values)).sum(axis=1)
        total += np.nansum(values, axis=1)
        squares += np.nansum(values**2, axis=1)
        labelled = labelled and scan.label is not None
        if labelled:
            rain += int(card.rain_of(scan)[rows].sum())
            judged += int((~card.unknown_of(scan)[rows]).sum())
    for name, known in zip(extra, count[len(USUAL_CHANNELS) :], strict=True):
        if not known:
            raise InputError(
                f"channel '{name}'",
                "no training scan has a column of numbers of that name",
                "Name columns of the scans; data.loading.columns names those of unnamed files.",
            )
    mean = total / np.maximum(count, 1)
    variance = squares / np.maximum(count, 1) - mean**2
    # A constant channel is not divided by 0.
    std = np.sqrt(np.where(variance > ROUNDING * mean**2, variance, 1.0))
    moments = dict(zip(channels, zip(mean.tolist(), std.tolist(), strict=True), strict=True))
    return card.completed(moments, rain / max(judged, 1) if labelled else None)
