"""The points of a PCD file in its three encodings.

Source: Point Cloud Library, "The PCD (Point Cloud Data) file format", version 0.7, and
PointCloudLibrary/pcl:io/src/pcd_io.cpp, whose compressed data leave the padding out.
"""

import math
from collections.abc import Callable
from dataclasses import replace
from typing import Any

import lzf
import numpy as np
from numpy.typing import NDArray

from derain.files.content import MemoryBudget
from derain.files.formats.pcd.header import PADDING, PcdHeader
from derain.files.text import format_rows, parse_rows


def _decode_ascii(header: PcdHeader, data: bytes, _: MemoryBudget) -> dict[str, NDArray[Any]]:
    table = parse_rows(data, header.row)
    _check_points(header, len(table), rest=0)
    return _columns_of_rows(header, table)


def _decode_binary(header: PcdHeader, data: bytes, _: MemoryBudget) -> dict[str, NDArray[Any]]:
    points, rest = divmod(len(data), header.row.itemsize)
    _check_points(header, points, rest)
    return _columns_of_rows(header, np.frombuffer(data, header.row, points))


def _decode_compressed(
    header: PcdHeader, data: bytes, budget: MemoryBudget
) -> dict[str, NDArray[Any]]:
    """One column after the other, all of them compressed as one block."""
    compressed_size, size = np.frombuffer(data, "<u4", count=2).tolist()
    named = replace(
        header, columns=tuple(column for column in header.columns if column[0] != PADDING)
    )
    if size == header.points * named.row.itemsize:  # no padding in the data
        header = named
    points, rest = divmod(size, header.row.itemsize)
    _check_points(header, points, rest)
    budget.reserve(size)
    plain = lzf.decompress(data[8 : 8 + compressed_size], size) if size else b""
    if plain is None or len(plain) != size:
        raise ValueError(f"the compressed data do not yield {size} bytes")
    fields, start = {}, 0
    for name, dtype in header.columns:
        values = np.frombuffer(plain, dtype.base, points * math.prod(dtype.shape), start)
        start += values.nbytes
        if name != PADDING:
            fields[name] = values.reshape(points, *dtype.shape)
    return fields


def _columns_of_rows(header: PcdHeader, table: NDArray[Any]) -> dict[str, NDArray[Any]]:
    return {
        name: table[str(place)] for place, (name, _) in enumerate(header.columns) if name != PADDING
    }


def _check_points(header: PcdHeader, points: int, rest: int) -> None:
    """Refuses data that are less than the header states, or too much to be whole points.

    A header may contradict itself (WIDTH · HEIGHT is not POINTS): one of the two numbers must be
    that of the data. Data of more whole points than either are taken as they are.
    """
    stated = {header.points, header.width * header.height}
    if points not in stated and (points < max(stated) or rest):
        raise ValueError(f"{points} points where the header states {max(stated)}")


def _encode_compressed(table: NDArray[Any]) -> bytes:
    plain = b"".join(table[name].tobytes() for name in table.dtype.names or ())
    # LZF makes incompressible data longer, by one byte in 32. It refuses to compress nothing.
    compressed = lzf.compress(plain, len(plain) * 17 // 16 + 64) or b""
    return np.array([len(compressed), len(plain)], "<u4").tobytes() + compressed


DECODERS: dict[str, Callable[[PcdHeader, bytes, MemoryBudget], dict[str, NDArray[Any]]]] = {
    "ascii": _decode_ascii,
    "binary": _decode_binary,
    "binary_compressed": _decode_compressed,
}
ENCODERS: dict[str, Callable[[NDArray[Any]], bytes]] = {
    "ascii": format_rows,
    "binary": np.ndarray.tobytes,
    "binary_compressed": _encode_compressed,
}
