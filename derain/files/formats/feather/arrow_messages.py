"""Checks what the messages of an Arrow stream expand to, for PyArrow allocates whatever they state.

Source: Apache Arrow, "Arrow Columnar Format", version 1.5, and its format/Message.fbs: the numbers
of the tables' members, and the eight bytes before a compressed buffer that say its size.
"""

import struct
from types import ModuleType
from typing import Any

from flatbuffers import number_types
from flatbuffers.table import Table

from derain.files.content import MemoryBudget

# Members of tables, by their place in Message.fbs.
_MESSAGE_HEADER = 2
_DICTIONARY_DATA = 1
_BATCH_BUFFERS = 2
_BATCH_COMPRESSION = 3
_COMPRESSION_CODEC = 0

_CODECS = ("lz4", "zstd")
_BUFFER = struct.Struct("<qq")  # where a buffer begins in the message's body, and its length
_SIZE = struct.Struct("<q")


def check_messages(arrow: ModuleType, stream: bytes, budget: MemoryBudget) -> str:
    """Takes room for what compressed messages of a stream expand to.

    Args:
        arrow: PyArrow.
        stream: The messages.
        budget: What there is.

    Returns:
        How they are compressed: "uncompressed", "lz4" or "zstd".

    Raises:
        ValueError: There is no room for them.
    """
    compression = "uncompressed"
    for message in arrow.ipc.MessageReader.open_stream(stream):
        if message.type not in ("record batch", "dictionary"):
            continue
        root = Table(memoryview(message.metadata), 0)
        batch = _member(Table(root.Bytes, root.Indirect(0)), _MESSAGE_HEADER)
        if batch is not None and message.type == "dictionary":
            batch = _member(batch, _DICTIONARY_DATA)
        codec = None if batch is None else _member(batch, _BATCH_COMPRESSION)
        if batch is not None and codec is not None:
            _take(batch, memoryview(message.body), budget)
            compression = _CODECS[
                codec.GetSlot(_slot(_COMPRESSION_CODEC), 0, number_types.Int8Flags)
            ]
    return compression


def _take(batch: Any, body: memoryview, budget: MemoryBudget) -> None:
    """Takes room for the buffers of a compressed batch."""
    place = batch.Offset(_slot(_BATCH_BUFFERS))
    first, count = batch.Vector(place), batch.VectorLen(place)
    for number in range(count):
        begin, length = _BUFFER.unpack_from(batch.Bytes, first + number * _BUFFER.size)
        if length > 0:
            (size,) = _SIZE.unpack_from(body, begin)
            budget.reserve(max(size, 0))  # -1 says that the buffer is not compressed


def _member(table: Any, number: int) -> Any:
    """A table that is a member of another; None where it is missing."""
    place = table.Offset(_slot(number))
    return Table(table.Bytes, table.Indirect(table.Pos + place)) if place else None


def _slot(number: int) -> int:
    """Where the place of a member stands in a table's index, behind two sizes of two bytes."""
    return 4 + 2 * number
