"""The manifest of a simulated data set: what it was made from, and the checksum of every file.

It is written twice: without ``files`` when the work begins, so that the folder is known for what it
is, and with them when every sequence is there.
"""

import hashlib
import json
from collections.abc import Mapping
from pathlib import Path
from typing import Any

from derain.files.atomic import replacing

MANIFEST = "manifest.json"

# By this a manifest is known.
MAKER = "derain.simulation"


def read_manifest(root: Path) -> dict[str, Any]:
    """The manifest of a simulated data set, finished or not; empty where there is none."""
    try:
        content = json.loads((root / MANIFEST).read_text("utf-8"))
    except (OSError, ValueError):
        return {}
    return content if isinstance(content, dict) and content.get("made_by") == MAKER else {}


def write_manifest(root: Path, content: Mapping[str, Any]) -> None:
    """Writes the manifest.

    Raises:
        InputError: It cannot be written.
    """
    with replacing(root / MANIFEST) as temporary:
        temporary.write_text(json.dumps(content, indent=2) + "\n", "utf-8")


def checksums(folder: Path, root: Path) -> dict[str, str]:
    """SHA-256 of every file below a folder, by its path from the root, in ascending order."""
    return {
        file.relative_to(root).as_posix(): hashlib.sha256(file.read_bytes()).hexdigest()
        for file in sorted(folder.rglob("*"))
        if file.is_file()
    }
