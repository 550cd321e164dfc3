"""The manifest of a simulated data set: its description, and the checksum of every file.

It is written twice: without ``files`` at the start, so that a resumed run recognises the folder,
and with ``files`` when every sequence is complete.
"""

import json
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

from derain.cards.card import SPLIT_PARTS
from derain.errors import InputError
from derain.files.atomic import write_text
from derain.files.documents import Entry
from derain.simulation.rain_field import HARDEST_RAIN

MANIFEST = "manifest.json"

# The value of ``made_by``, which distinguishes a manifest of derain from any other JSON file.
MAKER = "derain.simulation"

# Keys of the sequences of each part, of the rain rate of each sequence, of the checksums by path.
SPLIT, RAIN_RATE, FILES = "split", "rain_rate_mm_h", "files"

# In bytes. The entry of a file takes 130, so that half a million files fit.
LARGEST_MANIFEST = 2**26


def read_manifest(root: Path) -> dict[str, Any]:
    """The manifest of a simulated data set, finished or not; empty if there is none.

    Returns:
        As far as the file has them: ``split``, lists of sequences by part; ``rain_rate_mm_h``, by
        sequence; ``files``, checksums by path; and what the data set was made from.

    Raises:
        InputError: A manifest of derain's with a value of another kind.
    """
    try:
        document = Entry.of_json_file(root / MANIFEST, LARGEST_MANIFEST)
    except InputError:
        return {}
    content = document.value
    if not isinstance(content, dict) or content.get("made_by") != MAKER:
        return {}
    values = document.members()
    parsers: dict[str, Callable[[Entry], object]] = {
        SPLIT: lambda parts: parts.record(dict.fromkeys(SPLIT_PARTS, Entry.texts), SPLIT_PARTS),
        RAIN_RATE: rates_of_sequences,
        FILES: lambda files: files.each(Entry.text),
    }
    for key, read in parsers.items():
        if key in values:
            read(values[key])
    return content


def manifest_of(root: Path) -> dict[str, Any]:
    """The manifest of the simulated data set that a folder is, or is part of; empty if of none.

    Args:
        root: The data set, its folder of sequences, a sequence, or a sequence's folder of scans.
    """
    root = root.absolute()
    return next(filter(None, map(read_manifest, (root, *root.parents[:3]))), {})


def parameters_of(manifest: Mapping[str, Any], within: str = "") -> dict[str, Any]:
    """The parameters of the data set, each value by its path, such as ``campaign.sensor.rows``.

    Args:
        manifest: Content of a manifest.
        within: Path of its parent, with a dot at its end.
    """
    found: dict[str, Any] = {}
    for name, value in manifest.items():
        if within + name in (SPLIT, RAIN_RATE, FILES):
            continue
        if isinstance(value, dict):
            found |= parameters_of(value, f"{within}{name}.")
        else:
            found[within + name] = value
    return found


def rates_of_sequences(entry: Entry) -> dict[str, float]:
    """Rain rates in mm/h by the name of the sequence, which must be in quotes.

    Raises:
        InputError: Anything else, or a rate that no rain has.
    """
    return entry.each(lambda rate: rate.within(0, HARDEST_RAIN))


def write_manifest(root: Path, content: Mapping[str, Any]) -> None:
    """Writes the manifest.

    Raises:
        InputError: It cannot be written.
    """
    write_text(root / MANIFEST, json.dumps(content, indent=2) + "\n")
