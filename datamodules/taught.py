"""Recordings that a teacher has labelled: what ``derain teach`` wrote."""

from pathlib import Path

from derain.cards.card import load_card
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.errors import InputError
from derain.sources.source import Frames, Source
from derain.teaching.manifest import CARD, HELD_OUT_PART, TRAINING_PART, Manifest

# Scans of an epoch of training: as many steps as the rates of learning are chosen for.
FEWEST_SHOWN = 16


class Taught(ScanDataModule):
    """Scans with the labels of a teacher, and those that were held out as the validation part.

    Points of which the teacher is not sure are left out, of training and of measuring. So scores
    are agreement with the teacher, which says little of the truth. The held-out scans are those
    that are tested and predicted, too.

    Example:
        >>> from derain.filters import DROR, FilterDerainer
        >>> from derain.sources.folders import named_frames
        >>> from derain.teaching.teach import teach
        >>> scans = named_frames([Path("scan.bin")])
        >>> manifest = teach(FilterDerainer(DROR()), scans, Path("taught"))
        >>> data = Taught("taught")
        >>> data.card.name, [frame.key for frame in data.frames("train")]
        ('scans taught by dror', ['scan'])

    Args:
        root: The folder that ``derain teach`` wrote.
        loading: How the scans are read and batched; their columns are those that the teacher read,
            and intensities are in the unit that it saw.

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
                f"no scan is held out, so that there is none for {part}",
                "Teach a sequence of three scans or more.",
            )
        return frames

    def shown(self, part: Part) -> Source:
        """The scans of a part; to train on, each of a short recording several times an epoch.

        Augmentation changes it in another way each time. An epoch of a few scans would be too short
        to choose by.

        Raises:
            InputError: No scan was held out.
        """
        source = self.source(part)
        times = -(-FEWEST_SHOWN // len(source)) if part == "train" else 1
        return Frames([*source] * times)
