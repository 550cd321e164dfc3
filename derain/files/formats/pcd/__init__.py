"""Point clouds in the Point Cloud Library's format (`.pcd`)."""

import math
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.files.columns import describable_columns, records, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.files.formats.pcd.data import DECODERS, ENCODERS
from derain.files.formats.pcd.header import VALUE_TYPES, PcdHeader, parse_header
from derain.files.reading import reading
from derain.scan import Scan


@FORMATS.add(".pcd")
class Pcd(Format):
    """Files of the Point Cloud Library, version 0.7, in all of their encodings."""

    HELP = "Point Cloud Library: ascii, binary or binary_compressed"

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads a PCD file with every column it names.

        Args:
            content: The file, version 0.7: ascii, binary or binary_compressed.
            columns: Not used: a PCD names its columns.

        Returns:
            The scan; columns of several values per point are (N, COUNT), padding is left out.

        Raises:
            InputError: A file that is truncated or damaged, or has no coordinates.
        """
        with reading(content.path, ValueError):
            header, data = parse_header(content.data)
            fields = DECODERS[header.encoding](header, data, content.budget)
        points = len(next(iter(fields.values())))
        organised = header.height > 1 and header.width * header.height == points
        shape = (header.height, header.width) if organised else None
        return scan_of(content.path, fields, shape, header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns in the encoding and with the viewpoint of the PCD it came from.

        A scan from elsewhere becomes a binary PCD. Organised clouds stay organised.

        Raises:
            InputError: A column that no PCD can hold.
        """
        columns = {
            name: _with_one_count(column)
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


def _with_one_count(column: NDArray[Any]) -> NDArray[Any]:
    """A column of several values per point as (N, COUNT), for a PCD knows no further axes."""
    if column.ndim == 1:
        return column
    return column.reshape(len(column), math.prod(column.shape[1:]))
