"""Labelled scans for a bench to measure on, and for its baselines to learn from."""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

from derain.errors import InputError
from derain.scan import Bools, Scan
from derain.sources.frame import Frame
from derain.sources.reader import FrameReader
from derain.sources.spread import evenly_spaced

# Scans that a baseline learns from, at most.
MOST_TRAINING_SCANS = 200


@dataclass(frozen=True)
class LabelledFrames:
    """Labelled scans, and how they are read and counted.

    Attributes:
        reader: Reads them with their labels, in the unit of the methods.
        frames: The scans, one or more.
        rain_rates: Rain rate in mm/h by sequence, where it is known.

    Raises:
        InputError: No scans, or one without labels.
    """

    reader: FrameReader
    frames: Sequence[Frame]
    rain_rates: Mapping[str, float] = field(default_factory=dict)

    def __post_init__(self) -> None:
        if not self.frames:
            raise InputError("scans", "there are none", "Give one or more labelled scans.")
        for frame in self.frames:
            frame.require_labels()

    def truths(self) -> Iterator[tuple[Scan, Bools]]:
        """Reads some of the scans, spread evenly: points of known class, and which are rain.

        Raises:
            InputError: A file that cannot be read, or labels that are not on the data card.
        """
        for frame in evenly_spaced(self.frames, MOST_TRAINING_SCANS):
            yield self.reader.card.known_points(self.reader.read_measured(frame))
