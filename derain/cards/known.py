"""What the names of folders tell: the layouts of the packaged data cards."""

from collections.abc import Iterator
from functools import cache
from pathlib import Path

from derain.cards.card import DataCard, FoldersTell, load_card, packaged_cards
from derain.cards.layout import Layout
from derain.files.labels import LABEL, label_beside
from derain.files.names import scan_stem


@cache
def known_layouts() -> tuple[Layout, ...]:
    """The layouts of the packaged data cards, those first whose folders tell most."""
    cards = sorted(_packaged(), key=lambda card: _TOLD.index(card.folders_tell), reverse=True)
    return tuple(dict.fromkeys(card.layout for card in cards))


def card_by_folders(layout: Layout, tell: FoldersTell) -> DataCard | None:
    """The packaged data card that may be concluded from folders called as a layout says.

    Args:
        layout: What the folders are called.
        tell: What is asked of the card: ``classes`` or ``rain``.

    Returns:
        The card whose folders tell so much; None where none does.
    """
    return next(
        (
            card
            for card in _packaged()
            if card.layout.scans == layout.scans
            and _TOLD.index(card.folders_tell) >= _TOLD.index(tell)
        ),
        None,
    )


def label_of(scan: Path) -> Path:
    """Where a scan's labels lie: in the folder that its layout has for them, or beside it."""
    folder = scan.absolute().parent
    for layout in known_layouts():
        if folder.name == layout.scans and layout.labels != Layout().labels:
            return folder.parent / layout.labels / f"{scan_stem(scan)}{LABEL}"
    return label_beside(scan)


def label_places(scan: Path) -> Iterator[Path]:
    """Where labels of a scan are looked for beside its folder, whether or not any are there."""
    for folder in dict.fromkeys(layout.labels for layout in known_layouts()):
        yield Layout(labels=folder).label_of(scan)


@cache
def lidar_folders() -> tuple[str, ...]:
    """Names of folders with scans, those first that hold the scans of a LiDAR alone."""
    alone = (layout.lidar for layout in known_layouts() if layout.lidar)
    return tuple(dict.fromkeys([*alone, *(layout.scans for layout in known_layouts())]))


@cache
def _packaged() -> tuple[DataCard, ...]:
    return tuple(map(load_card, packaged_cards()))


# From the least to the most that folders tell.
_TOLD: tuple[FoldersTell, ...] = ("nothing", "classes", "rain")
