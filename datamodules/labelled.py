"""Labelled scans as a user names them: files, folders of scans, or the root of a data set.

Nothing here loads torch.
"""

import os
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import partial
from pathlib import Path

from derain.annotation.manifest import CARD, Manifest, is_taught
from derain.cards.card import DataCard, load_card, packaged_cards
from derain.cards.known import card_by_folders, layouts_for
from derain.datamodules.scan_data import Loading, Part, ScanData, split_source, taught_source
from derain.errors import InputError
from derain.example import example_folder, or_example
from derain.files.documents import Entry
from derain.simulation.manifest import RAIN_RATE, manifest_of, rates_of_sequences, read_manifest
from derain.sources.folders import named_frames
from derain.sources.search import find_layout
from derain.sources.source import Source


@dataclass
class LabelledScans(ScanData):
    """Labelled scans that a user names.

    Attributes:
        card: Data card of the scans.
        loading: Options for reading scans.
        source_of: Returns the scans of a part.
        has_parts: True if the parts differ; where not, every part is all scans.
    """

    card: DataCard
    loading: Loading
    source_of: Callable[[Part], Source]
    has_parts: bool = True

    def source(self, part: Part) -> Source:
        """The scans of a part, in order, and where their labels should be.

        Raises:
            InputError: Missing folders or scans.
        """
        return self.source_of(part)


def labelled_scans(
    paths: Sequence[Path], card: DataCard, loading: Loading, topic: str | None = None
) -> LabelledScans:
    """The scans that a command's ``--data`` names.

    Args:
        paths: Scans and folders of scans; or the root of one data set, with a folder
            ``sequences`` and the split of its manifest if it is simulated, else of its card; or a
            folder that ``derain teach`` wrote, whose labels are used.
        card: Data card of the scans.
        loading: Options for reading scans.
        topic: Topic of the bags among them; None where each has only one of clouds.

    Raises:
        InputError: A root beside other paths.
    """
    taught = [path for path in paths if is_taught(path)]
    roots = taught or [path for path in paths if os.path.isdir(path / card.layout.sequences)]
    if not roots:
        return named_scans(paths, card, loading, topic)
    root = roots[0]
    if len(paths) > 1:
        raise InputError(
            root,
            "is a data set, and cannot be combined with other scans",
            "Name it alone, or its sequences one by one.",
        )
    if taught:
        source_of = partial(taught_source, root, Manifest.read(root))
        return LabelledScans(load_card(root / CARD), loading, source_of)
    split = read_manifest(root).get("split") or card.split
    layout = find_layout(root / card.layout.sequences, layouts_for(card)) or card.layout
    # The folder of sequences has the name in this card, whatever another layout calls it.
    layout = replace(layout, sequences=card.layout.sequences)
    return LabelledScans(card, loading, partial(split_source, root, layout, split, loading.columns))


def named_scans(
    paths: Sequence[Path], card: DataCard, loading: Loading, topic: str | None = None
) -> LabelledScans:
    """Scans named one by one or by their folders, the same ones for every part.

    A scan's labels are ``<stem>.label`` beside it or in the sibling folder of labels.

    Args:
        paths: Scans, folders with scans directly in them, and sequences.
        card: Data card of the scans. Its layout is the first to be searched for sequences and
            labels.
        loading: Options for reading scans.
        topic: Topic of the bags among them; None where each has only one of clouds.
    """

    def source_of(part: Part) -> Source:
        layouts = layouts_for(card)
        return named_frames(paths, loading.columns, labelled=True, layouts=layouts, topic=topic)

    return LabelledScans(card, loading, source_of, has_parts=False)


def card_of(paths: Sequence[Path], name: str | None) -> DataCard:
    """Data card of the scans that ``--data`` names.

    Args:
        paths: Scans and folders of scans, or the root of one data set.
        name: A packaged card or a YAML file; None takes that of simulated data where the first
            path is the example or a simulated data set, that of a teacher's labels in a taught
            folder, and else recognises REHEARSE-3D by its folders.

    Raises:
        InputError: No such card, or data that are not recognised.
    """
    if name is not None:
        return load_card(name)
    root = or_example(paths[0])
    if manifest_of(root) or root == example_folder():
        return load_card("simulated")
    if is_taught(root):
        return load_card(root / CARD)
    layout = find_layout(root)
    if layout is not None and (card := card_by_folders(layout, "rain")):
        return card
    raise InputError(
        root,
        "nothing in it shows which labels are rain",
        f"Give --card: {', '.join(packaged_cards())}, or a YAML file.",
    )


def rain_rates(paths: Sequence[Path], file: Path | None) -> Mapping[str, float]:
    """Rain rate of each sequence in mm/h, by its name, where it is known.

    Args:
        paths: Paths of ``--data``.
        file: YAML file of ``"<sequence>": <mm/h>``; None takes a simulated data set's manifest.

    Raises:
        InputError: A file of another kind.
    """
    if file is None:
        return dict(manifest_of(paths[0]).get(RAIN_RATE, {}))
    return rates_of_sequences(Entry.of_yaml(file))
