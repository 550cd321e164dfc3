"""The layouts of the packaged data cards, and what follows from the names of folders."""

from collections.abc import Collection, Iterable, Iterator
from functools import cache
from pathlib import Path

from derain.cards.card import AUTO_DETECTIONS, AutoDetect, DataCard, load_card, packaged_cards
from derain.cards.layout import Layout
from derain.files.labels import label_beside


def cards_naming(ids: Collection[int]) -> list[str]:
    """Names of the packaged data cards that have all of some ids among their classes."""
    return [name for name, card in _packaged().items() if set(ids) <= card.classes.keys()]


@cache
def known_layouts() -> tuple[Layout, ...]:
    """The layouts of the packaged data cards, those first from whose folders most follows."""
    cards = sorted(_packaged().values(), key=lambda card: _rank(card.auto_detect), reverse=True)
    return tuple(dict.fromkeys(card.layout for card in cards))


def card_by_folders(layout: Layout, least: AutoDetect) -> DataCard | None:
    """The packaged data card that follows from folders of a layout.

    Args:
        layout: Names of the folders.
        least: Required conclusion: ``classes`` or ``rain``.

    Returns:
        The card from whose folders so much follows; None without one.
    """
    cards = [card for card in _packaged().values() if card.layout.scans == layout.scans]
    return next((card for card in cards if _rank(card.auto_detect) >= _rank(least)), None)


def layouts_for(card: DataCard | None) -> tuple[Layout, ...]:
    """The layouts that data of a card may have: the card's own first, then the packaged ones."""
    own = () if card is None else (card.layout,)
    return tuple(dict.fromkeys((*own, *known_layouts())))


def label_of(scan: Path, layouts: Iterable[Layout] | None = None) -> Path:
    """Path of a scan's labels: beside it, or in the folder that its layout has for them.

    Args:
        scan: The scan.
        layouts: Those that it may have, the likeliest first; by default those of the packaged data
            cards.
    """
    folder = scan.absolute().parent.name
    known = known_layouts() if layouts is None else layouts
    layout = next((layout for layout in known if layout.scans == folder), Layout())
    return label_beside(scan, layout.labels)


def label_places(scan: Path) -> Iterator[Path]:
    """Places to look for the labels of a scan beside its folder, existing or not."""
    for folder in dict.fromkeys(layout.labels for layout in known_layouts()):
        yield Layout(labels=folder).label_of(scan)


@cache
def lidar_folders() -> tuple[str, ...]:
    """Names of folders with scans, those first that hold the scans of a LiDAR alone."""
    alone = (layout.lidar for layout in known_layouts() if layout.lidar)
    return tuple(dict.fromkeys([*alone, *(layout.scans for layout in known_layouts())]))


@cache
def _packaged() -> dict[str, DataCard]:
    return {name: load_card(name) for name in packaged_cards()}


def _rank(detected: AutoDetect) -> int:
    """Rank of folder names by how much follows from them, from the least to the most."""
    return AUTO_DETECTIONS.index(detected)
