"""Times of the scans of a folder: its ``metadata.csv``, which REHEARSE-3D has as well."""

import csv
import io
import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.names import COMPRESSED
from derain.files.reading import is_file, read_bytes, reading
from derain.scan import Floats

METADATA = "metadata.csv"

# Bytes of the lines of a hundred thousand scans. In memory a line takes up to forty times as much.
LARGEST_METADATA = 2**23

# Names of the columns that hold a scan's name and its time.
FRAME_COLUMNS = ("frame", "timestamp")


def read_frame_times(scans: Sequence[Path]) -> Floats:
    """Reads when scans of one folder were taken.

    Args:
        scans: The scans, at least one. A line of the ``metadata.csv`` beside them belongs to the
            scan of that name. Suffixes and leading zeros do not count: 000012.bin, 000012 and 12
            are one name, and so are 1634567.25.bin and 1634567.25.

    Returns:
        The time of each scan, float64 (N,), in the file's own unit, which should be seconds.

    Raises:
        InputError: A file that is missing or damaged, lacks a column or a scan, or gives a scan
            two times.
    """
    path = scans[0].parent / METADATA
    if not is_file(path):
        raise InputError(
            path,
            "there is no such file",
            "Write one: a line frame,timestamp, then one for each scan, such as 000000,12.3.",
        )
    times: dict[str, float] = {}
    for name, time in _lines(path):
        if times.setdefault(_key(name), time) != time:
            raise InputError(path, f"gives {name} two times", "Leave one line for each scan.")
    for scan in scans:
        if _key(scan.name) not in times:
            raise InputError(path, f"has no line for {scan.name}", "Add it, or move the scan away.")
    return np.array([times[_key(scan.name)] for scan in scans])


def _lines(path: Path) -> Iterator[tuple[str, float]]:
    """The name and the time of a scan, line by line."""
    with reading(path, ValueError, csv.Error):
        text = read_bytes(path, LARGEST_METADATA).decode("utf-8-sig")
        lines = csv.DictReader(io.StringIO(text, newline=""), restval="", skipinitialspace=True)
        present = lines.fieldnames or ()
        if not set(FRAME_COLUMNS) <= set(present):
            reason = f"has no columns {' and '.join(FRAME_COLUMNS)} ({', '.join(present)})"
            raise InputError(path, reason, "Rename those of the scan's name and its time.")
        for line in lines:
            name, time = (line[column] for column in FRAME_COLUMNS)
            if not (name and math.isfinite(float(time))):
                raise ValueError(f"the line '{name},{time}' is not a scan and its time")
            yield name, float(time)


def _key(name: str) -> str:
    stem, dot, suffix = name.removesuffix(COMPRESSED).rpartition(".")
    # Digits after a point are no suffix: scans may be named by the time of the frame.
    return (stem if dot and not suffix.isdigit() else name).lstrip("0")
