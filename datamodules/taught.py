"""The data module of recordings that a teacher labelled."""

from pathlib import Path

from derain.annotation.manifest import CARD, Manifest
from derain.cards.card import load_card
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.datamodules.scan_data import taught_source
from derain.sources.source import Frames, Source

# Scans of a training epoch, at least: the learning rates are chosen for this many steps.
FEWEST_SHOWN = 16


class Taught(ScanDataModule):
    """Scans with a teacher's labels; the held-out scans are the validation part.

    Points of which the teacher is not sure are left out, in training and in measuring. Scores are
    agreement with the teacher, not with the truth. Test and prediction use the held-out scans, too.

    Example:
        >>> from pathlib import Path
        >>> from derain.filters import DROR, FilterDerainer
        >>> from derain.sources.folders import named_frames
        >>> from derain.annotation.teach import teach
        >>> scans = named_frames([Path("scan.bin")])
        >>> results = teach(FilterDerainer(DROR()), scans, Path("taught"))
        >>> data = Taught("taught")
        >>> data.card.name, [frame.key for frame in data.frames("train")]
        ('scans taught by dror', ['scan'])

    Args:
        root: The folder that ``derain teach`` wrote.
        loading: Options for reading and batching scans; their columns and the unit of their
            intensities are those that the teacher read.

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
        return taught_source(self.root, self.manifest, part)

    def epoch_source(self, part: Part) -> Source:
        """The scans of a part; those of a short training recording several times an epoch.

        Augmentation changes each differently every time. Epochs of a few scans would be too short
        to select checkpoints by.

        Raises:
            InputError: No scan was held out.
        """
        source = self.source(part)
        times = -(-FEWEST_SHOWN // len(source)) if part == "train" else 1
        return Frames([*source] * times)
