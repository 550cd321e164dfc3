"""Per-point labels in SemanticKITTI's format (`.label`): uint32, class low, instance high.

Source: Behley et al. 2019, SemanticKITTI; github.com/PRBonn/semantic-kitti-api, README.
"""

import os
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.names import beside
from derain.files.reading import file_size, read_bytes, reading
from derain.scan import LARGEST_ID, Array, Ints

LABEL = ".label"


def label_beside(scan: Path, folder: str = "labels") -> Path:
    """Path of a scan's labels: beside it if they are there, else in the sibling folder."""
    label = beside(scan, LABEL)
    # The folder above the scan's, also where the scan is named from within its own.
    sequence = scan.absolute().parent.parent
    # Not Path.is_file, which raises where the name has become too long by its suffix.
    return label if os.path.isfile(label) else sequence / folder / label.name


def read_labels(path: Path, points: int) -> NDArray[np.uint32]:
    """Reads the labels of a scan as they are in the file.

    Args:
        path: The file.
        points: Number of points of the scan.

    Returns:
        uint32 (points,): class in the low, instance in the high 16 bits. Scans take them as labels,
        and :func:`derain.scan.class_ids` gives the classes alone.

    Raises:
        InputError: A file that cannot be read, or that does not hold one label per point.
    """
    with reading(path, ValueError):
        size = file_size(path)
        if size != 4 * points:
            raise InputError(
                path,
                f"holds {size / 4:g} labels of 4 bytes for a scan of {points} points",
                "Give the label file that belongs to the scan, and all of the scan's --columns; "
                "`derain run` writes the labels of the scan that it reads, not of the cleaned one.",
            )
        return np.frombuffer(read_bytes(path, size), "<u4", points).astype(np.uint32)


def instance(raw: NDArray[np.uint32]) -> Ints:
    """Instance ids, int64 (N,), of labels as `read_labels` gives them."""
    return (raw >> 16).astype(np.int64)


def write_labels(path: Path, semantic: Array, instance: Array | None = None) -> None:
    """Writes one label per point.

    Args:
        path: The file to write.
        semantic: Class ids, integers or bool (N,), 0 to 65,535.
        instance: Instance ids, integers (N,), 0 to 65,535; None writes 0.

    Raises:
        InputError: An id out of range, or a file that cannot be written.
    """
    if instance is None:
        instance = np.zeros_like(semantic)
    for ids in (semantic, instance):
        if ((ids < 0) | (ids > LARGEST_ID)).any():
            reason = f"a label lies outside 0 to {LARGEST_ID}"
            raise InputError(path, reason, "A label file has 16 bits for each id.")
    raw = semantic.astype("<u4") | instance.astype("<u4") << np.uint32(16)
    with replacing(path) as temporary:
        temporary.write_bytes(raw.data)  # not tofile, which hides why it fails
