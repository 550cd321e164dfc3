"""Point clouds in the Point Cloud Library's format (`.pcd`)."""

import math
from dataclasses import replace
from pathlib import Path

import numpy as np

from derain.files.atomic import replacing
from derain.files.columns import describable_columns, records, scan_of
from derain.files.pcd_data import DECODERS, ENCODERS
from derain.files.pcd_header import VALUE_TYPES, PcdHeader, parse_header
from derain.files.reading import reading
from derain.scan import Scan


def read_pcd(path: Path) -> Scan:
    """Reads a PCD file with every column it names.

    Args:
        path: The file, version 0.7: ascii, binary or binary_compressed.

    Returns:
        The scan; columns of several values per point are (N, COUNT), padding is left out.

    Raises:
        InputError: A file that cannot be read, is truncated or damaged, or has no coordinates.
    """
    with reading(path, ValueError):
        header, data = parse_header(path.read_bytes())
        fields = DECODERS[header.encoding](header, data)
    points = len(next(iter(fields.values())))
    organised = header.height > 1 and header.width * header.height == points
    return scan_of(path, fields, (header.height, header.width) if organised else None, header)


def write_pcd(path: Path, scan: Scan) -> None:
    """Writes a scan's columns in the encoding and with the viewpoint of the PCD it came from.

    A scan from elsewhere becomes a binary PCD. Organised clouds stay organised.

    Raises:
        InputError: A column that no PCD can hold, or a file that cannot be written.
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
    data = ENCODERS[header.encoding](records(columns, header.row))
    with replacing(path) as temporary:
        temporary.write_bytes(header.to_bytes() + data)
