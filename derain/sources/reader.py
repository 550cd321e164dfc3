"""Reads the scan of a frame for a model or a measurement: in its unit, with its labels."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from derain.cards.card import DataCard
from derain.cards.known import cards_naming
from derain.errors import InputError
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.views.channels import with_columns
from derain.views.morton import first_rows


@dataclass(frozen=True)
class FrameReader:
    """Reads scans in the unit of their data card, with the labels that their frames have.

    Attributes:
        card: Which labels there are.
        intensity_scale: Factor from the scans' intensities to the unit of the card.
        columns: Columns to keep besides those of every scan: to a model, the others
            would only cost memory. None keeps all.
        distinct: True if points at one position are measured once.
    """

    card: DataCard
    intensity_scale: float = 1.0
    columns: Sequence[str] | None = None
    distinct: bool = False

    def read(self, frame: Frame) -> Scan:
        """Reads all rows of a scan, with its labels if they are to be read.

        Raises:
            InputError: A scan that cannot be read, or labels that are not in the data card.
        """
        scan = self.read_unlabelled(frame)
        wanted = frame.label_path is not None or frame.has_labels
        return self.with_labels(scan, frame) if wanted else scan

    def read_unlabelled(self, frame: Frame) -> Scan:
        """Reads all rows of a scan, whether or not there are labels.

        Raises:
            InputError: A scan that cannot be read.
        """
        scan = frame.read().with_intensity_times(self.intensity_scale)
        return scan if self.columns is None else with_columns(scan, self.columns)

    def read_distinct(self, frame: Frame) -> Scan:
        """Reads a scan with its labels, and of the points at one position the first.

        Raises:
            InputError: A scan that cannot be read, or labels that are not in the data card.
        """
        scan = self.read(frame)
        return scan.take(first_rows(scan))

    def read_measured(self, frame: Frame) -> Scan:
        """Reads the points of a scan that are measured, with their labels.

        Raises:
            InputError: A scan that cannot be read, or labels that are not in the data card.
        """
        return self.read_distinct(frame) if self.distinct else self.read(frame)

    def with_labels(self, scan: Scan, frame: Frame) -> Scan:
        """The scan with the labels of its frame; the data card defines all of them."""
        label = frame.read_label(len(scan))
        if frame.label_map is not None:
            label = frame.label_map(label, str(frame.label_path or frame.name))
        unknown = np.setdiff1d(label, list(self.card.classes))
        if len(unknown):
            others = cards_naming(np.unique(label).tolist())
            either = f"Give --card {' or '.join(others)}, or name" if others else "Name"
            raise InputError(
                frame.label_path or frame.name,
                f"ids {unknown[:5].tolist()} are no classes of {self.card.name}",
                f"{either} them in the data card.",
            )
        return scan.with_label(label)
