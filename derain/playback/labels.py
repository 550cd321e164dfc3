"""What labels that lie with the scans say of their points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.playback.entities import OfLabels
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader


@dataclass(frozen=True, eq=False)
class LabelledRain:
    """What labels say of the points of one scan.

    Attributes:
        rain: True for rain, bool (N,).
        known: False for points of which they do not know, bool (N,).
    """

    rain: NDArray[np.bool_]
    known: NDArray[np.bool_]


@dataclass(frozen=True)
class Labels:
    """Labels that lie with scans.

    Attributes:
        card: Their data card.
        name: What they are: ``truth``, or ``teacher``.
    """

    card: DataCard
    name: str = "truth"

    @property
    def stand_at(self) -> OfLabels:
        """Where they stand in a recording to look at."""
        return OfLabels(self.name)

    def of(self, frame: Frame, scan: Scan) -> LabelledRain | None:
        """What they say of a scan; None where it has none.

        Args:
            frame: The frame.
            scan: Its scan, which has been read.

        Raises:
            InputError: Labels that are damaged, or that the data card does not know.
        """
        if not frame.has_labels:
            return None
        labelled = FrameReader(self.card).with_labels(scan, frame)
        return LabelledRain(self.card.rain_of(labelled), ~self.card.unknown_of(labelled))
