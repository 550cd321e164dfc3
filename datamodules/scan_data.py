"""Scans of a data set by part, and how they are read: what measuring needs, and training too.

Nothing here loads torch.
"""

from abc import ABC, abstractmethod

from derain.cards.card import DataCard
from derain.datamodules.loading import Loading, Part
from derain.datamodules.needed_labels import with_needed_labels
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.sources.source import Source


class ScanData(ABC):
    """Labelled scans of which some are to train on, others to validate and to test.

    Args:
        card: Data card of the scans.
        loading: How the scans are read.
    """

    def __init__(self, card: DataCard, loading: Loading) -> None:
        self.card = card
        self.loading = loading

    @property
    def distinct(self) -> bool:
        """Whether points at one position are measured once."""
        return self.loading.counts_once(self.card)

    @abstractmethod
    def source(self, part: Part) -> Source:
        """The scans of a part of the data, in order, and where their labels should be.

        Raises:
            InputError: Missing folders or scans.
        """

    def frames(self, part: Part) -> Source:
        """The scans of a part of the data, in order, each with the labels that are read there.

        Raises:
            InputError: Missing folders or scans, or labels missing where they are needed.
        """
        return with_needed_labels(self.source(part), part, self._reads_labels)

    def read(self, frame: Frame) -> Scan:
        """Reads a scan with its labels; for a model, with the columns that it sees.

        Raises:
            InputError: A file that cannot be read, or labels that are not in the data card.
        """
        return self._reader.read(frame)

    def read_measured(self, frame: Frame) -> Scan:
        """Reads what is measured of a scan, with its labels.

        Raises:
            InputError: A file that cannot be read, or labels that are not in the data card.
        """
        return (self._reader.read_distinct if self.distinct else self._reader.read)(frame)

    @property
    def _reads_labels(self) -> bool:
        """Whether training and validation need labels."""
        return True

    @property
    def _reader(self) -> FrameReader:
        return FrameReader(self.card, self.loading.intensity_scale)
