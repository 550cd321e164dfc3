"""The labels that a teacher gives, and the data card that says what they mean."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.files.atomic import replacing
from derain.sources.judgement import Judgement

# Class ids of what a teacher says of a point.
TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN = 0, 1, 255

CLASSES = {TAUGHT_NOT_RAIN: "not rain", TAUGHT_RAIN: "rain", TAUGHT_UNKNOWN: "not known"}


def labels_of(judgement: Judgement) -> NDArray[np.uint32]:
    """What a teacher says of each row of a scan, uint32 (N,), as it is written.

    Not known is what it is not sure of, and every row that cannot be judged or that it did not see.
    """
    labels = np.where(judgement.rain, np.uint32(TAUGHT_RAIN), np.uint32(TAUGHT_NOT_RAIN))
    labels[~(judgement.answered & judgement.scan.valid)] = TAUGHT_UNKNOWN
    return labels


def write_card(path: Path, teacher: str, scans: DataCard | None) -> None:
    """Writes the data card of labels that a teacher gave; its statistics are measured in training.

    Args:
        path: The file.
        teacher: Its name.
        scans: Data card of the scans, which has their licence, their unit, and whether their points
            count once; None where there is none.

    Raises:
        InputError: It cannot be written.
    """
    card: dict[str, Any] = {
        "name": f"{'scans' if scans is None else scans.name} taught by {teacher}",
        "classes": CLASSES,
        "rain": [TAUGHT_RAIN],
        "unknown": [TAUGHT_UNKNOWN],
        "licence": f"derived from scans whose licence is {_licence(scans)}",
    }
    if scans is not None:
        card |= {
            "intensity_unit": scans.intensity_unit,
            "simulated": scans.simulated,
            "deduplicate": scans.deduplicate,
        }
    with replacing(path) as temporary:
        temporary.write_text(yaml.safe_dump(card, sort_keys=False, allow_unicode=True), "utf-8")


def _licence(scans: DataCard | None) -> str:
    return "not stated" if scans is None else scans.licence
