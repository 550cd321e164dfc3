"""From a data set's files to batches of views."""

from abc import ABC, abstractmethod
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from typing import Any, Literal

import lightning
import numpy as np
from torch.utils.data import DataLoader

from derain.cards.card import DataCard
from derain.datamodules.augmentation import Augmentation
from derain.datamodules.order import MeasuringOrder, TrainingOrder
from derain.datamodules.scan_dataset import LateLoader, ScanDataset, ScanFile, packed
from derain.datamodules.statistics import measured
from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS, read_scan
from derain.files.labels import read_labels, semantic
from derain.learning.batch import Batch, Sample
from derain.learning.seeds import run_seed
from derain.scan import Scan
from derain.sources.spread import evenly_spaced
from derain.sources.training_record import by_fingerprint
from derain.spec import Spec
from derain.views.channels import extra_channels, with_columns
from derain.views.morton import first_rows

Part = Literal["train", "validation", "test", "predict"]


@dataclass(frozen=True)
class Loading:
    """How scans are read and batched.

    Attributes:
        batch_size: Scans in a batch.
        workers: Processes that read and view scans; 0 does it in the training process.
        columns: Names of the columns of files that do not name them.
        intensity_scale: What takes the scans' intensities to the unit of the data card, e.g. 255.
        deduplicate: Whether points at one position are measured once; None does as the data card
            says. Predictions are for every row in any case.
        augmentation: What training changes about its scans.
    """

    batch_size: int = 1
    workers: int = 0
    columns: tuple[str, ...] = DEFAULT_COLUMNS
    intensity_scale: float = 1.0
    deduplicate: bool | None = None
    augmentation: Augmentation = field(default_factory=Augmentation)


class ScanDataModule(lightning.LightningDataModule, ABC):
    """Batches of views of scans, for training, validation, test and prediction.

    Which view is the model's to say: its loaders ask the model that the trainer holds.

    Args:
        card: Data card of the scans; statistics it lacks are taken from the training scans.
        loading: How the scans are read and batched.
    """

    def __init__(self, card: DataCard, loading: Loading) -> None:
        super().__init__()
        self.card = card
        self.loading = loading

    @property
    def distinct(self) -> bool:
        """Whether points at one position are measured once."""
        asked = self.loading.deduplicate
        return self.card.deduplicate if asked is None else asked

    @abstractmethod
    def find(self, part: Part) -> list[ScanFile]:
        """The scans of a part of the data, in order, and where their labels should lie.

        Raises:
            InputError: Missing folders or scans.
        """

    def files(self, part: Part) -> list[ScanFile]:
        """The scans of a part of the data, in order, each with the labels that are read there.

        Prediction reads none, nor does the training of a model that does not learn from labels. In
        such a model's validation they measure and choose nothing: there it reads those it finds.

        Raises:
            InputError: Missing folders or scans, or labels missing where they are needed.
        """
        files = self.find(part)
        if part == "predict" or (part == "train" and not self._learns_from_labels):
            return [replace(file, label=None) for file in files]
        if part == "validation" and not self._learns_from_labels:
            return [file if _has_labels(file) else replace(file, label=None) for file in files]
        for file in files:
            if not _has_labels(file):
                raise InputError(
                    file.scan,
                    f"its labels are not at {file.label}",
                    "Add them or leave the scan out.",
                )
        return files

    def setup(self, stage: str) -> None:
        """Completes the data card from the training scans where it lacks statistics."""
        extra = [name for name in self._extra_channels if name not in self.card.extra]
        if stage == "fit" and (extra or not self.card.has_statistics):
            self.card = measured(self.card, self.training_scans(most=200), extra)

    def training_scans(self, most: int) -> Iterator[Scan]:
        """Reads some of the training scans, spread over all of them, as they are in their files.

        Args:
            most: How many, where there are so many.

        Raises:
            InputError: A scan that cannot be read.
        """
        return map(self.read, evenly_spaced(self.files("train"), most))

    def validation_scans(self, most: int) -> Iterator[Scan]:
        """Reads some of the validation scans, as :meth:`training_scans` those of the training.

        Raises:
            InputError: A scan that cannot be read.
        """
        return map(self.read, evenly_spaced(self.files("validation"), most))

    def training_record(self) -> dict[str, tuple[str, ...]]:
        """Which scans it trains on, for the Spec of what is trained on them."""
        return by_fingerprint([file.scan for file in self.find("train")])

    def train_dataloader(self) -> DataLoader[Sample | InputError]:
        """Training scans, in another order and augmented anew every epoch."""
        return self._loader("train")

    def val_dataloader(self) -> DataLoader[Sample | InputError]:
        """Validation scans, in order."""
        return self._loader("validation")

    def test_dataloader(self) -> DataLoader[Sample | InputError]:
        """Test scans, in order."""
        return self._loader("test")

    def predict_dataloader(self) -> DataLoader[Sample | InputError]:
        """Test scans, whether or not they have labels, every row of them."""
        return self._loader("predict")

    def read(self, file: ScanFile) -> Scan:
        """Reads a scan with its labels.

        Raises:
            InputError: A file that cannot be read, or labels that are not in the data card.
        """
        scan = read_scan(file.scan, self.loading.columns)
        scan = scan.with_intensity_times(self.loading.intensity_scale)
        if self._model is not None:  # to a model, the file's other columns would only cost memory
            scan = with_columns(scan, self._extra_channels)
        if file.label is None:
            return scan
        label = semantic(read_labels(file.label, len(scan)))
        unknown = np.setdiff1d(label, list(self.card.classes))
        if len(unknown):
            raise InputError(
                file.label,
                f"ids {unknown[:5].tolist()} are no classes of {self.card.name}",
                "Name them in the data card.",
            )
        return scan.with_label(label)

    def read_measured(self, file: ScanFile) -> Scan:
        """Reads what is measured of a scan, with its labels.

        Raises:
            InputError: A file that cannot be read, or labels that are not in the data card.
        """
        return self._read_distinct(file) if self.distinct else self.read(file)

    def on_before_batch_transfer(self, batch: Batch | InputError, dataloader_idx: int) -> Batch:
        """Raises what went wrong where the batch was made, perhaps in another process."""
        if isinstance(batch, InputError):
            raise batch
        return batch

    def _loader(self, part: Part) -> DataLoader[Sample | InputError]:
        spec: Spec = self.trainer.lightning_module.spec  # type: ignore[union-attr, assignment]
        # Jitter would pull equal points apart, which the view takes for one in deployment.
        read = {"train": self._read_distinct, "predict": self.read}.get(part, self.read_measured)
        dataset = ScanDataset(
            self.files(part),
            read,
            spec.make_view(threads=1 if self.loading.workers else 0),
            self.card,
            self.loading.augmentation if part == "train" else None,
            run_seed(),
        )
        return LateLoader(
            dataset,
            batch_size=self.loading.batch_size,
            sampler=self._order(part, dataset),
            num_workers=self.loading.workers,
            persistent_workers=self.loading.workers > 0,
            collate_fn=packed,
        )

    def _order(self, part: Part, dataset: ScanDataset) -> TrainingOrder | MeasuringOrder:
        assert self.trainer is not None  # it is what asks for loaders
        processes, process = self.trainer.world_size, self.trainer.global_rank
        if part == "train":
            return TrainingOrder(dataset, dataset.seed, processes, process)
        return MeasuringOrder(dataset, self.loading.batch_size, processes, process)

    @property
    def _model(self) -> Any:
        return getattr(self.trainer, "lightning_module", None)

    @property
    def _learns_from_labels(self) -> bool:
        return self._model is None or bool(self._model.LEARNS_FROM_LABELS)

    @property
    def _extra_channels(self) -> tuple[str, ...]:
        return () if self._model is None else extra_channels(self._model.channels)

    def _read_distinct(self, file: ScanFile) -> Scan:
        scan = self.read(file)
        return scan.take(first_rows(scan))


def _has_labels(file: ScanFile) -> bool:
    return file.label is not None and file.label.is_file()
