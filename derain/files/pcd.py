"""Point clouds in the Point Cloud Library's format (`.pcd`)."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from derain.files.columns import describable_columns, records, scan_of
from derain.files.content import Content
from derain.files.pcd_data import DECODERS, ENCODERS
from derain.files.pcd_header import VALUE_TYPES, PcdHeader, parse_header
from derain.files.reading import reading
from derain.scan import Scan


def decode_pcd(content: Content) -> Scan:
    """Reads a PCD file with every column it names.

    Args:
        content: The file, version 0.7: ascii, binary or binary_compressed.

    Returns:
        The scan; columns of several values per point are (N, COUNT), padding is left out.

    Raises:
        InputError: A file that is truncated or damaged, or has no coordinates.
    """
    with reading(content.path, ValueError):
        header, data = parse_header(content.data)
        fields = DECODERS[header.encoding](header, data, content.room)
    points = len(next(iter(fields.values())))
    organised = header.height > 1 and header.width * header.height == points
    shape = (header.height, header.width) if organised else None
    return scan_of(content.path, fields, shape, header)


def encode_pcd(path: Path, scan: Scan) -> bytes:
    """A scan's columns in the encoding and with the viewpoint of the PCD it came from.

    A scan from elsewhere becomes a binary PCD. Organised clouds stay organised.

    Raises:
        InputError: A column that no PCD can hold.
    """
    columns = {
        name: column.reshape(len(scan), math.prod(column.shape[1:])) if column.ndim > 1 else column
        for name, column in describable_columns(path, scan, VALUE_TYPES).items()
    }
    height, width = scan.shape or (1, len(scan))
    header = PcdHeader(
        tuple(
            (name, np.dtype((column.dtype.newbyteorder("<"), column.shape[1:])))
            for name, column in columns.items()
        ),
        width,
        height,
        points=len(scan),
    )
    if isinstance(scan.header, PcdHeader):
        header = replace(header, encoding=scan.header.encoding, viewpoint=scan.header.viewpoint)
    return header.to_bytes() + ENCODERS[header.encoding](records(columns, header.row))
