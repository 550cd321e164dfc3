"""Scans and labels in sequences, which a split assigns to train, validation and test."""

from collections.abc import Mapping, Sequence
from dataclasses import replace
from pathlib import Path

from derain.cards.card import load_card
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.datamodules.scan_data import split_source
from derain.sources.source import Source
from derain.sources.training_record import record_of_sequences


class Sequences(ScanDataModule):
    """Any data set of sequences, described by its data card alone.

    A new data set needs no code, only a card with the names of its folders, its split, its classes,
    and whether points at one position count once.

    Example:
        >>> data = Sequences("KITTI", card="kitti")
        >>> data.card.layout.scans, data.split["validation"]
        ('velodyne', ('08', '09'))

    Args:
        root: Folder of the data set.
        card: Name of a packaged data card, or a YAML file.
        split: Sequences of ``train``, ``validation`` and ``test``, in place of the card's.
        loading: Options for reading and batching scans.
    """

    def __init__(
        self,
        root: str,
        card: str,
        split: Mapping[str, Sequence[str]] | None = None,
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(load_card(card), loading)
        self.root = Path(root)
        # Of a card, which refuses other parts.
        self.split = replace(self.card, split=split or self.card.split).split

    def source(self, part: Part) -> Source:
        """The scans of a part's sequences, in order; for prediction those of the test part.

        Raises:
            InputError: A missing sequence or scan folder.
        """
        return split_source(self.root, self.card.layout, self.split, self.loading.columns, part)

    def training_record(self) -> dict[str, tuple[str, ...]]:
        """The training scans, recorded by the names of their sequences.

        Simulated sequences have the same names in every data set: their scans are recorded instead.
        """
        if self.card.simulated:
            return super().training_record()
        return record_of_sequences(self.split.get("train", ()))
