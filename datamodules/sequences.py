"""The data modules of sequences: what any data set of that layout is trained on by."""

from derain.cards.card import load_card
from derain.datamodules.base import Loading, ScanDataModule
from derain.datamodules.sequence_data import SequenceData
from derain.sources.training_record import by_name


class SequenceDataModule(SequenceData, ScanDataModule):
    """Scans and labels in sequences, which a split assigns to train, validation and test.

    Args:
        root: Folder of the data set.
        card: Data card of the scans.
        layout: Names of its folders.
        split: Sequences of ``train``, ``validation`` and ``test``; by default the data card's.
        loading: How the scans are read and batched.
    """

    def training_record(self) -> dict[str, tuple[str, ...]]:
        """Which scans it trains on: those of whole sequences.

        Simulated sequences are called the same in every data set, so that their names say nothing.
        """
        if self.card.simulated:
            return super().training_record()
        return by_name(self.split.get("train", ()))


class Sequences(SequenceDataModule):
    """Any data set of sequences, of which its data card says everything.

    A data set that derain does not know needs no code, but a card: what its folders are called, its
    split, its classes, and whether points at one position count once.

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
