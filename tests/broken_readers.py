"""Readers that do what no reader may, each in its own way; in a module, for other processes."""

import ctypes
import os
from collections.abc import Mapping
from pathlib import Path

import numpy as np

from benchmarks.fuzzing.reader import Reader
from derain.errors import InputError

SOUND = bytes(range(200))


def readers() -> Mapping[str, Reader]:
    """The readers by what is wrong with them."""
    return {
        read.__name__: Reader(read.__name__, "file", read, lambda: [SOUND])
        for read in (sound, raises, believes, aborts, crashes, hoards, speaks, refuses)
    }


def sound(path: Path) -> None:
    if path.read_bytes() != SOUND:
        raise InputError(path, "is damaged", "Write it again.")


def raises(path: Path) -> None:
    {SOUND: path}[path.read_bytes()]


def believes(path: Path) -> None:
    assert path.read_bytes() == SOUND, "a wrong result"


def aborts(path: Path) -> None:
    if path.read_bytes() != SOUND:
        os.abort()


def crashes(path: Path) -> None:
    if path.read_bytes() != SOUND:
        ctypes.string_at(0)


def hoards(path: Path) -> None:
    if path.read_bytes() != SOUND:
        np.ones(1_100_000_000, np.uint8)


def speaks(path: Path) -> None:
    if path.read_bytes() != SOUND:
        raise InputError("x" * 10**4, "y" * 10**6, "Remedy.")


def refuses(path: Path) -> None:
    raise InputError(path, "is damaged", "Write it again.")
