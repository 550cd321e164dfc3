"""Data modules of scans in sequences."""

from derain.cards.card import load_card
from derain.datamodules.base import Loading, ScanDataModule
from derain.datamodules.scan_data import SequenceData


class SequenceDataModule(SequenceData, ScanDataModule):
    """Scans and labels in sequences, which a split assigns to train, validation and test.

    Args:
        root: Folder of the data set.
        card: Data card of the scans.
        layout: Names of its folders.
        split: Sequences of ``train``, ``validation`` and ``test``; by default the data card's.
        loading: How the scans are read and batched.
    """


class Sequences(SequenceDataModule):
    """Any data set of sequences, described by its data card alone.

    A new data set needs no code, only a card with the names of its folders, its split, its classes,
    and whether points at one position count once.

    Example:
        >>> data = Sequences("KITTI", card="kitti")
        >>> data.layout.scans, data.split["validation"]
        ('velodyne', ('08', '09'))

    Args:
        root: Folder of the data set.
        card: Name of a packaged data card, or a YAML file.
        split: Sequences of ``train``, ``validation`` and ``test``, in place of the card's.
        loading: How the scans are read and batched.
    """

    def __init__(
        self,
        root: str,
        card: str,
        split: dict[str, list[str]] | None = None,
        loading: Loading = Loading(),
    ) -> None:
        known = load_card(card)
        super().__init__(root, known, known.layout, split, loading)
