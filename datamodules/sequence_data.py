"""The layout of SemanticKITTI and its kin: a folder of sequences, each with scans and labels.

Nothing here loads torch.
"""

from collections.abc import Mapping, Sequence
from pathlib import Path

from derain.cards.card import DataCard
from derain.cards.layout import Layout
from derain.datamodules.loading import Loading, Part
from derain.datamodules.scan_data import ScanData
from derain.errors import InputError
from derain.sources.folders import sequence_frames
from derain.sources.source import Source


class SequenceData(ScanData):
    """Scans and labels in sequences, which a split assigns to train, validation and test.

    Args:
        root: Folder of the data set.
        card: Data card of the scans.
        layout: Names of its folders.
        split: Sequences of ``train``, ``validation`` and ``test``; by default the data card's.
        loading: How the scans are read and batched.
    """

    def __init__(
        self,
        root: str,
        card: DataCard,
        layout: Layout,
        split: Mapping[str, Sequence[str]] | None,
        loading: Loading,
    ) -> None:
        super().__init__(card, loading)
        self.root = Path(root)
        self.layout = layout
        self.split = split or card.split

    def source(self, part: Part) -> Source:
        """The scans of a part's sequences, in order; for prediction those of the test part.

        Raises:
            InputError: A missing sequence or scan folder.
        """
        sequences = self.split.get("test" if part == "predict" else part, ())
        if not sequences:
            raise InputError(self.root, f"no sequences are named for {part}", "Give a split.")
        return sequence_frames(
            [self._folder(name) for name in sequences], self.layout, self.loading.columns
        )

    def _folder(self, name: str) -> Path:
        folder = self.root / self.layout.sequences / name
        if not (folder / self.layout.scans).is_dir():
            raise InputError(
                folder / self.layout.scans,
                f"no such folder, though the split names sequence {name}",
                "Check the root. If only some sequences are there, give `derain fit` a "
                "--data.split, and other commands the folders of scans.",
            )
        return folder
