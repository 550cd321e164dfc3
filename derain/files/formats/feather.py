"""Columns in Arrow's file format (`.feather`, version 2), read and written by PyArrow; Argoverse 2.

Source: Apache Arrow, "Arrow Columnar Format", version 1.5, section on IPC, and its
format/Message.fbs: the numbers of the tables' members, and the eight bytes before a compressed
buffer that hold its size.
"""

import struct
from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np

from derain.files.columns import columns_of, no_place, scan_of
from derain.files.content import Content, MemoryBudget, check_columns
from derain.files.format import FORMATS, Format
from derain.scan import Array, Scan
from derain.system.extras import FLATBUFFERS, PYARROW, require

# What the file begins with; what follows is a stream of messages.
_MAGIC = b"ARROW1\0\0"

# Members of tables, by their place in Message.fbs.
_MESSAGE_HEADER = 2
_DICTIONARY_DATA = 1
_BATCH_BUFFERS = 2
_BATCH_COMPRESSION = 3
_COMPRESSION_CODEC = 0

_CODECS = ("lz4", "zstd")
_BUFFER = struct.Struct("<qq")  # where a buffer begins in the message's body, and its length
_SIZE = struct.Struct("<q")


@dataclass(frozen=True, eq=False)
class FeatherHeader:
    """The content of a Feather file besides numbers: text, missing values, metadata of the schema.

    Attributes:
        table: The file, a pyarrow.Table with a row for each point.
        compression: Its name: "uncompressed", "lz4" or "zstd".
    """

    table: Any
    compression: str

    def take(self, rows: Array) -> "FeatherHeader":
        """The table of some of the points only."""
        return replace(self, table=self.table.take(np.arange(self.table.num_rows)[rows]))


@FORMATS.add(".feather")
class Feather(Format):
    """Tables in Arrow's file format, compressed or not."""

    HELP = "Arrow tables, version 2"
    DAMAGE = (Exception,)
    EXTRA = PYARROW

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads a Feather file.

        Args:
            content: The file, version 2.
            columns: Not used: a table names its columns.

        Returns:
            The scan. Its fields are the columns of numbers; a missing number is NaN, which makes a
            column of whole numbers float64.

        Raises:
            InputError: A file that is damaged, or has no coordinates; PyArrow is not installed.
        """
        arrow = PYARROW.load(content.path)
        require(content.path, FLATBUFFERS)
        if not content.data.startswith(_MAGIC):
            raise ValueError("it does not begin as Feather version 2 does")
        # Read as a stream, so that PyArrow reads exactly the checked messages.
        stream = content.data[len(_MAGIC) :]
        compression = _check_messages(arrow, stream, content.budget)
        with arrow.ipc.open_stream(stream) as messages:
            table = messages.read_all()
        table.validate(full=True)
        check_columns(table.num_columns)
        content.budget.reserve(table.nbytes)
        if len(set(table.column_names)) < table.num_columns:
            raise ValueError("two columns have one name")
        fields = {
            name: column.to_numpy()
            for name, column in zip(table.column_names, table.columns, strict=True)
            if arrow.types.is_integer(column.type) or arrow.types.is_floating(column.type)
        }
        return scan_of(content.path, fields, header=FeatherHeader(table, compression))

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns in the order, types and compression of the file that it came from.

        Raises:
            InputError: A column that no table can hold; PyArrow is not installed.
        """
        arrow = PYARROW.load(path)
        feather = PYARROW.load(path, "feather")
        header = scan.header if isinstance(scan.header, FeatherHeader) else None
        if header is not None and header.table.num_rows != len(scan):
            header = None
        held = {name: header.table[name] for name in header.table.column_names} if header else {}
        for name, column in columns_of(scan).items():
            if column.ndim > 1 or column.dtype.kind not in "biuf" or column.dtype.itemsize > 8:
                raise no_place(path, name, column)
            exact = column.dtype.kind == "f"
            if name not in held or not np.array_equal(
                held[name].to_numpy(), column, equal_nan=exact
            ):
                held[name] = arrow.array(column.astype(column.dtype.newbyteorder("=")))
        table = arrow.table(held)
        if header is not None:
            table = table.replace_schema_metadata(header.table.schema.metadata)
        sink = arrow.BufferOutputStream()
        feather.write_feather(table, sink, header.compression if header else "lz4")
        return bytes(sink.getvalue())


def _check_messages(arrow: ModuleType, stream: bytes, budget: MemoryBudget) -> str:
    """Reserves memory for the expanded messages of a compressed stream.

    PyArrow allocates any size that they state.

    Args:
        arrow: PyArrow.
        stream: The messages.
        budget: The available memory.

    Returns:
        How they are compressed: "uncompressed", "lz4" or "zstd".

    Raises:
        ValueError: There is no room for them.
    """
    from flatbuffers import number_types
    from flatbuffers.table import Table

    compression = "uncompressed"
    for message in arrow.ipc.MessageReader.open_stream(stream):
        if message.type not in ("record batch", "dictionary"):
            continue
        root = Table(memoryview(message.metadata), 0)
        batch = _member(Table(root.Bytes, root.Indirect(0)), _MESSAGE_HEADER)
        if message.type == "dictionary":
            batch = _member(batch, _DICTIONARY_DATA)
        codec = _member(batch, _BATCH_COMPRESSION)
        if codec is not None:
            _reserve_expanded(batch, memoryview(message.body), budget)
            number = codec.GetSlot(_slot(_COMPRESSION_CODEC), 0, number_types.Int8Flags)
            compression = _CODECS[number]
    return compression


def _reserve_expanded(batch: Any, body: memoryview, budget: MemoryBudget) -> None:
    """Takes room for the buffers of a compressed batch."""
    place = batch.Offset(_slot(_BATCH_BUFFERS))
    first, count = batch.Vector(place), batch.VectorLen(place)
    for number in range(count):
        begin, length = _BUFFER.unpack_from(batch.Bytes, first + number * _BUFFER.size)
        if length > 0:
            (size,) = _SIZE.unpack_from(body, begin)
            budget.reserve(max(size, 0))  # -1 of a buffer that is not compressed


def _member(table: Any, number: int) -> Any:
    """A table that is a member of another; None if it is missing."""
    place = table.Offset(_slot(number))
    return type(table)(table.Bytes, table.Indirect(table.Pos + place)) if place else None


def _slot(number: int) -> int:
    """Position of a member's offset in a table's index, after two sizes of two bytes."""
    return 4 + 2 * number
