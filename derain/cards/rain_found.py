"""Labelled scans in which no point is rain: they have none, or their data card is the wrong one.

Training and tuning refuse them. A measurement counts only false positives there, and warns.
"""

from pathlib import Path

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.system.notices import warn

REMEDY = "Give scans with rain, and the data card of their labels."


def require_rain(found: bool, card: DataCard, subject: str | Path) -> None:
    """Refuses to learn from labelled scans without rain.

    Args:
        found: True if any point of the scans is rain.
        card: Their data card.
        subject: Name of the scans in messages.

    Raises:
        InputError: No point is rain.
    """
    if not found:
        raise InputError(subject, _without_rain(card), REMEDY)


def warn_without_rain(found: bool, card: DataCard) -> None:
    """Warns where scans without rain are measured, unless the data card is one of clean data.

    Args:
        found: True if any point of the scans is rain.
        card: Their data card.
    """
    if card.rain and not found:
        warn(f"{_without_rain(card)}: only false positives are measured. {REMEDY}")


def _without_rain(card: DataCard) -> str:
    rain = ", ".join(card.classes[id_] for id_ in card.rain) or "rain"
    return f"no point of these scans is {rain} by the data card of {card.name}"
