"""Labelled scans as a user names them: files, folders of scans, or the root of a data set."""

import os
from collections.abc import Mapping, Sequence
from pathlib import Path

from derain.cards.card import DataCard, load_card, packaged_cards
from derain.cards.known import card_by_folders, known_layouts
from derain.cards.layout import Layout
from derain.datamodules.base import Loading, Part, ScanDataModule
from derain.datamodules.sequences import SequenceDataModule
from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.manifest import RAIN_RATE, rates_of_sequences, read_manifest
from derain.sources.folders import named_frames
from derain.sources.source import Source


class NamedScans(ScanDataModule):
    """Scans named one by one or by their folders, the same ones for every part.

    A scan's labels are ``<stem>.label`` beside it or in the sibling folder of labels.

    Args:
        paths: Scans, and folders with scans directly in them.
        card: Data card of the scans.
        loading: How the scans are read.
    """

    def __init__(self, paths: Sequence[Path], card: DataCard, loading: Loading) -> None:
        super().__init__(card, loading)
        self.paths = paths

    def source(self, part: Part) -> Source:
        """The scans, in the order they are named, those of a folder sorted by name.

        Raises:
            InputError: A path that does not exist, or a folder without scans.
        """
        return named_frames(self.paths, self.loading.columns, labelled=True)


def labelled_scans(paths: Sequence[Path], card: DataCard, loading: Loading) -> ScanDataModule:
    """The scans that a command's ``--data`` names.

    Args:
        paths: Scans and folders of scans; or the root of one data set, which has a folder
            ``sequences`` and the split of its manifest, if it was simulated, else of its card.
        card: Data card of the scans.
        loading: How the scans are read.

    Raises:
        InputError: A root whose sequences hold no folder of scans that is known.
    """
    root = paths[0]
    if len(paths) > 1 or not os.path.isdir(root / card.layout.sequences):
        return NamedScans(paths, card, loading)
    split = read_manifest(root).get("split")
    return SequenceDataModule(str(root), card, _layout_of(root, card), split, loading)


def card_of(paths: Sequence[Path], name: str | None) -> DataCard:
    """Data card of the scans that ``--data`` names.

    Args:
        paths: Scans and folders of scans, or the root of one data set.
        name: A packaged card or a YAML file; None asks a simulated data set's manifest, and knows
            REHEARSE-3D by its folders.

    Raises:
        InputError: No such card, or data that do not say whose they are.
    """
    if name is not None:
        return load_card(name)
    root = paths[0]
    if read_manifest(root):
        return load_card("simulated")
    layout = _layout_in(root)
    if layout is not None and (card := card_by_folders(layout, "rain")):
        return card
    raise InputError(
        root,
        "nothing in it says which labels are rain",
        f"Give --card: {', '.join(packaged_cards())}, or a YAML file.",
    )


def rain_rates(paths: Sequence[Path], file: Path | None) -> Mapping[str, float]:
    """Rain rate of each sequence in mm/h, by its name, as far as it is known.

    Args:
        paths: What ``--data`` names.
        file: YAML file of ``"<sequence>": <mm/h>``; None takes a simulated data set's manifest.

    Raises:
        InputError: A file that is not of this kind.
    """
    if file is None:
        return dict(read_manifest(paths[0]).get(RAIN_RATE, {}))
    return rates_of_sequences(Entry.of_yaml(file))


def _layout_in(root: Path, first: Layout | None = None) -> Layout | None:
    """The layout of a data set's folders; None where none is known."""
    layouts = dict.fromkeys([*([first] if first else []), *known_layouts()])
    return next(
        (layout for layout in layouts if any(root.glob(f"{layout.sequences}/*/{layout.scans}"))),
        None,
    )


def _layout_of(root: Path, card: DataCard) -> Layout:
    layout = _layout_in(root, card.layout)
    if layout is None:
        folders = dict.fromkeys(known.scans for known in (card.layout, *known_layouts()))
        raise InputError(
            root / card.layout.sequences,
            f"no sequence has a folder {' or '.join(folders)}",
            "Name the folders of scans themselves, or say in --card what they are called.",
        )
    return layout
