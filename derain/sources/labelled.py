"""Scans with their labels."""

import numpy as np

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.scan import Scan
from derain.sources.frame import Frame


def with_labels(scan: Scan, frame: Frame, card: DataCard) -> Scan:
    """The scan of a frame with its labels.

    Args:
        scan: What was read of the frame, all of its rows.
        frame: The frame.
        card: Says which labels there are.

    Raises:
        InputError: Labels that cannot be read, or that are not on the data card.
    """
    label = frame.read_label(len(scan))
    unknown = np.setdiff1d(label, list(card.classes))
    if len(unknown):
        raise InputError(
            frame.label_path or frame.name,
            f"ids {unknown[:5].tolist()} are no classes of {card.name}",
            "Name them in the data card.",
        )
    return scan.with_label(label)
