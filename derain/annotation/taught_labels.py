"""The labels that a teacher gives, and the data card that describes them."""

from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.evaluation.answers import TEACHERS_ANSWERS
from derain.files.atomic import replacing
from derain.sources.judgement import Judgement

# Class ids of a teacher's answers.
TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN = 0, 1, 255

_IDS = (TAUGHT_NOT_RAIN, TAUGHT_RAIN, TAUGHT_UNKNOWN)
TAUGHT_CARD = DataCard(
    "taught",
    classes=dict(zip(_IDS, TEACHERS_ANSWERS.values(), strict=True)),
    rain=(TAUGHT_RAIN,),
    unknown=(TAUGHT_UNKNOWN,),
)


def labels_of(judgement: Judgement) -> NDArray[np.uint32]:
    """The labels of each row of a judged scan, uint32 (N,), as they are written.

    Rows of which the method is not sure, which it did not see or which hold no return are unknown.
    """
    labels = np.where(judgement.rain, np.uint32(TAUGHT_RAIN), np.uint32(TAUGHT_NOT_RAIN))
    labels[~(judgement.answered & judgement.scan.valid)] = TAUGHT_UNKNOWN
    return labels


def write_card(path: Path, teacher: str, scans: DataCard | None) -> None:
    """Writes the data card of a teacher's labels; training measures its statistics.

    Args:
        path: The file.
        teacher: Name of the teacher.
        scans: Data card of the scans, which gives their licence, their unit, and whether points at
            one position count once; None where there is none.

    Raises:
        InputError: It cannot be written.
    """
    card: dict[str, Any] = {
        "name": f"{'scans' if scans is None else scans.name} taught by {teacher}",
        "classes": dict(TAUGHT_CARD.classes),
        "rain": [*TAUGHT_CARD.rain],
        "unknown": [*TAUGHT_CARD.unknown],
        "licence": f"derived from scans whose licence is {(scans or TAUGHT_CARD).licence}",
    }
    if scans is not None:
        card |= {
            "intensity_unit": scans.intensity_unit,
            "simulated": scans.simulated,
            "deduplicate": scans.deduplicate,
        }
    with replacing(path) as temporary:
        temporary.write_text(yaml.safe_dump(card, sort_keys=False, allow_unicode=True), "utf-8")
