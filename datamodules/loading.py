"""How scans are read and batched."""

from dataclasses import dataclass, field
from typing import Literal

from derain.cards.card import DataCard
from derain.datamodules.augmentation import Augmentation
from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS

Part = Literal["train", "validation", "test", "predict"]


@dataclass(frozen=True)
class Loading:
    """How scans are read and batched.

    Attributes:
        batch_size: Scans in a batch.
        workers: Processes that read and view scans; 0 does it in the training process.
        columns: Names of the columns of files that do not name them.
        intensity_scale: Factor from the scans' intensities to the unit of the data card, e.g. 255.
        deduplicate: Whether points at one position are measured once; None follows the data card.
            Predictions cover every row in any case.
        augmentation: How training changes its scans.
        cache_mb: Memory in which training scans are kept from epoch to epoch, so that they
            are not read again, and as much for validation scans. Workers divide it among them.

    Raises:
        InputError: Fewer scans, processes or megabytes than there can be.
    """

    batch_size: int = 1
    workers: int = 0
    columns: tuple[str, ...] = DEFAULT_COLUMNS
    intensity_scale: float = 1.0
    deduplicate: bool | None = None
    augmentation: Augmentation = field(default_factory=Augmentation)
    cache_mb: int = 512

    def __post_init__(self) -> None:
        least = {"batch_size": 1, "workers": 0, "cache_mb": 0}
        for name, fewest in least.items():
            if getattr(self, name) < fewest:
                raise InputError(
                    name, f"{getattr(self, name)} is too few", f"Give {fewest} or more."
                )

    def counts_once(self, card: DataCard) -> bool:
        """Whether points at one position are measured once."""
        return card.deduplicate if self.deduplicate is None else self.deduplicate
