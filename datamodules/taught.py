"""The data module of recordings that a teacher has labelled."""

from derain.datamodules.base import Part, ScanDataModule
from derain.datamodules.taught_data import TaughtData
from derain.sources.source import Frames, Source

# Scans of an epoch of training: as many steps as the rates of learning are chosen for.
FEWEST_SHOWN = 16


class Taught(TaughtData, ScanDataModule):
    """Scans with the labels of a teacher, and those that were held out as the validation part.

    Points of which the teacher is not sure are left out, of training and of measuring. So scores
    are agreement with the teacher, which says little of the truth. The held-out scans are those
    that are tested and predicted, too.

    Example:
        >>> from pathlib import Path
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
