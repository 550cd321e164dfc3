"""Whether a file is whole, whatever derain wrote it."""

import json
import sqlite3
from collections.abc import Callable
from pathlib import Path

import yaml
from PIL import Image

from derain.bags.bag import Bag
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.models.checkpoint import load_model


def fault_of(file: Path, size: int | None) -> str | None:
    """What is wrong with a file; None if it is whole, or is one that its writer only adds to.

    Args:
        file: The file.
        size: Its length undisturbed, in bytes, where that is known.
    """
    if file.suffix in _READERS:
        try:
            _READERS[file.suffix](file)
        except Exception as error:
            return f"{type(error).__name__}: {error}"
    elif file.suffix in (".bin", ".label") and size not in (None, file.stat().st_size):
        return f"{file.stat().st_size} bytes, not {size}"
    return None


def _lines(file: Path) -> None:
    assert file.read_text("utf-8").endswith("\n"), "the last line is cut"


def _yaml(file: Path) -> None:
    assert yaml.safe_load(file.read_text("utf-8")) is not None, "empty"


def _picture(file: Path) -> None:
    with Image.open(file) as image:
        image.load()


def _bag(file: Path) -> None:
    assert sum(1 for _ in Bag(file).messages()), "no messages"


def _database(file: Path) -> None:
    with sqlite3.connect(file) as database:
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]


_READERS: dict[str, Callable[[Path], object]] = {
    ".bag": _bag,
    ".ckpt": load_model,
    ".csv": _lines,
    ".db": _database,
    ".db3": _bag,
    ".json": lambda file: json.loads(file.read_text("utf-8")),
    ".mcap": _bag,
    ".md": _lines,
    ".npz": read_scan,
    ".onnx": Derainer,
    ".png": _picture,
    ".yaml": _yaml,
}
