"""Recordings that a teacher has labelled: what ``derain teach`` wrote.

Nothing here loads torch.
"""

from pathlib import Path

from derain.cards.card import load_card
from derain.datamodules.loading import Loading, Part
from derain.datamodules.scan_data import ScanData
from derain.errors import InputError
from derain.sources.source import Source
from derain.teaching.held_out import FEWEST_SCANS
from derain.teaching.manifest import CARD, HELD_OUT_PART, TRAINING_PART, Manifest


class TaughtData(ScanData):
    """Scans with the labels of a teacher, and those that were held out as the validation part.

    Args:
        root: The folder that ``derain teach`` wrote.
        loading: How the scans are read; their columns are those that the teacher read, and
            intensities are in the unit that it saw.

    Raises:
        InputError: No such folder, or one that is damaged or not complete.
    """

    def __init__(self, root: str, loading: Loading = Loading()) -> None:
        self.root = Path(root)
        self.manifest = Manifest.read(self.root)
        super().__init__(load_card(self.root / CARD), loading)

    def source(self, part: Part) -> Source:
        """The scans of a part, in order: the held-out ones for every part but ``train``.

        Raises:
            InputError: No scan was held out.
        """
        frames = self.manifest.frames(
            self.root, TRAINING_PART if part == "train" else HELD_OUT_PART
        )
        if not len(frames):
            raise InputError(
                self.root,
                f"none of its labelled scans is for {part}",
                f"Of a sequence with {FEWEST_SCANS} or more labelled scans the last ones are held "
                "out: see what `derain teach` warned of.",
            )
        return frames
