"""The records of an MCAP file, by their places in it.

The library of MCAP's makers parses and writes them. Its readers are not used: they unpack lz4 to
any size, accept a record that is cut off, compare no checksum of the summary or of an attachment,
and drop the records of applications.

Source: the MCAP specification, version 0 (https://mcap.dev/spec).
"""

import os
import struct
from collections.abc import Callable, Iterable, Iterator
from io import BytesIO
from typing import Any, BinaryIO
from zlib import crc32

from mcap import records
from mcap.data_stream import ReadDataStream
from mcap.opcode import Opcode

from derain.bags.unpacking import PORTION, check_size, unpack

MAGIC = b"\x89MCAP0\r\n"

# What parses the records that are read; of messages, see `_message`.
PARSERS: dict[int, Callable[[ReadDataStream], records.McapRecord]] = {
    Opcode.HEADER: records.Header.read,
    Opcode.FOOTER: records.Footer.read,
    Opcode.SCHEMA: records.Schema.read,
    Opcode.CHANNEL: records.Channel.read,
    Opcode.CHUNK: records.Chunk.read,
    Opcode.CHUNK_INDEX: records.ChunkIndex.read,
    Opcode.ATTACHMENT: records.Attachment.read,
    Opcode.STATISTICS: records.Statistics.read,
    Opcode.METADATA: records.Metadata.read,
    Opcode.DATA_END: records.DataEnd.read,
}

# Kinds that the specification defines; those from 0x80 on are private records of an application.
SPECIFIED = range(1, max(Opcode) + 1)

# A record begins with its kind and the bytes that follow; a message with its channel, its number,
# and when it was recorded and published.
HEAD, MESSAGE_HEAD = struct.Struct("<BQ"), struct.Struct("<HIQQ")
CHECKSUM = struct.Struct("<I")
FOOTER_SIZE = 20


# The place of a record: its kind, the offset of its first byte, and the bytes after its head.
Place = tuple[int, int, int]


class McapRecords:
    """The records of an MCAP file.

    Args:
        file: The file, open.

    Attributes:
        profile: The header's name for the kind of recording, such as ``ros2``.
        data: Bytes from the first to the last of the data.
        summary: Bytes of the summary, which follows them; empty where there is none.

    Raises:
        ValueError: No MCAP, or one that is cut off or damaged.
        OSError: It cannot be read.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = os.fstat(file.fileno()).st_size
        self._read_frame()

    def places(self) -> Iterator[Place]:
        """Places of the records of the data, without those within chunks."""
        return _places(self._file, *self.data)

    def private(self) -> Iterator[bytes]:
        """Private records of the data and of the summary, with their heads."""
        for begin, end in (self.data, self.summary):
            for kind, offset, size in _places(self._file, begin, end):
                if kind not in SPECIFIED:
                    yield self._bytes(offset, HEAD.size + size)

    def check_data(self, end: int) -> None:
        """Compares the checksum of the data with their bytes, where the file has one.

        Args:
            end: Place of the record that ends the data.

        Raises:
            ValueError: They differ.
        """
        portions = (
            self._bytes(start, min(PORTION, end - start)) for start in range(0, end, PORTION)
        )
        stated = self.read(end, Opcode.DATA_END).data_section_crc
        _check_crc("its data", stated, portions)

    def read(self, offset: int, kind: int) -> Any:
        """The record at a place.

        Raises:
            ValueError: There is none of that kind, or a damaged one.
        """
        body = self._body(offset, kind)
        if kind == Opcode.ATTACHMENT:
            (stated,) = CHECKSUM.unpack(body[-CHECKSUM.size :])
            _check_crc("an attachment", stated, [body[: -CHECKSUM.size]])
        return _parsed(kind, body)

    def in_summary(self) -> Iterator[tuple[int, Any]]:
        """Kind and content of each record of the summary; see :meth:`in_chunk`.

        Raises:
            ValueError: It is damaged.
        """
        begin, end = self.summary
        check_size(end - begin)
        content = self._bytes(begin, end - begin)
        footer = self._bytes(end, HEAD.size + FOOTER_SIZE - CHECKSUM.size)
        _check_crc("its summary", self._summary_crc, [content, footer])
        return _records(content, most=len(content))

    def in_chunk(self, chunk: records.Chunk) -> Iterator[tuple[int, Any]]:
        """Kind and content of each record of a chunk; None is the content of private records.

        Records that are not needed, such as indexes of messages, are left out.

        Raises:
            ValueError: It is damaged.
        """
        check_size(chunk.uncompressed_size)
        content = unpack(chunk.data, chunk.compression)
        if len(content) != chunk.uncompressed_size:
            raise ValueError(
                f"a chunk states {chunk.uncompressed_size:,} bytes, and unpacks to {len(content):,}"
            )
        _check_crc("a chunk", chunk.uncompressed_crc, [content])
        return _records(content, most=len(chunk.data))

    def _read_frame(self) -> None:
        """Finds where the data and the summary are."""
        end = self._size - len(MAGIC)
        footer_at = end - FOOTER_SIZE - HEAD.size
        if self._bytes(0, len(MAGIC)) != MAGIC:
            raise ValueError("it does not begin with the magic bytes of MCAP")
        if footer_at < len(MAGIC) or self._bytes(end, len(MAGIC)) != MAGIC:
            raise ValueError("it does not end with the magic bytes of MCAP")
        content = self._body(footer_at, Opcode.FOOTER)
        if len(content) != FOOTER_SIZE:
            raise ValueError("its footer is damaged")
        footer = _parsed(Opcode.FOOTER, content)
        header = self._body(len(MAGIC), Opcode.HEADER)
        self.profile: str = _parsed(Opcode.HEADER, header).profile
        begin = len(MAGIC) + HEAD.size + len(header)
        summary = footer.summary_start or footer_at
        if not begin <= summary <= footer_at:
            raise ValueError("its summary is in the wrong place")
        self.data = begin, summary
        self.summary = summary, footer_at
        self._summary_crc = footer.summary_crc

    def _body(self, offset: int, kind: int) -> bytes:
        found, size = HEAD.unpack(self._bytes(offset, HEAD.size))
        if found != kind:
            raise ValueError(f"another record than expected at byte {offset:,}")
        if kind != Opcode.ATTACHMENT:  # which may be of any size
            check_size(size)
        return self._bytes(offset + HEAD.size, size)

    def _bytes(self, offset: int, size: int) -> bytes:
        if offset < 0 or offset + size > self._size:
            raise ValueError(f"it ends before byte {offset + size:,}")
        self._file.seek(offset)
        return self._file.read(size)


def _places(file: BinaryIO, begin: int, end: int) -> Iterator[Place]:
    """Places of consecutive records, each of which ends within the part."""
    while begin < end:
        file.seek(begin)
        head = file.read(HEAD.size)
        if len(head) < HEAD.size:
            raise ValueError("a record is cut off")
        kind, size = HEAD.unpack(head)
        if begin + HEAD.size + size > end:
            raise ValueError(f"a record of {size:,} bytes at byte {begin:,} is cut off")
        yield kind, begin, size
        begin += HEAD.size + size


def _records(content: bytes, most: int) -> Iterator[tuple[int, Any]]:
    """Kind and content of each record.

    Args:
        content: The records.
        most: How many there may be. The time of each message differs, so a chunk that unpacks to
            more records than it has bytes is made to fill the memory.
    """
    view = memoryview(content)
    for number, (kind, offset, size) in enumerate(_places(BytesIO(content), 0, len(content))):
        if number >= most:
            raise ValueError(f"a chunk of {most:,} bytes unpacks to more records than that")
        if kind == Opcode.MESSAGE or kind in PARSERS:
            yield kind, _parsed(kind, view[offset + HEAD.size :][:size])
        elif kind not in SPECIFIED:
            yield kind, None


def _parsed(kind: int, body: bytes | memoryview) -> Any:
    if kind == Opcode.MESSAGE:
        return _message(body)
    return PARSERS[kind](ReadDataStream(BytesIO(body)))


def _message(body: bytes | memoryview) -> records.Message:
    """Parses a message; three times as fast as the library, which copies its data twice."""
    if len(body) < MESSAGE_HEAD.size:
        raise ValueError("a message is cut off")
    channel, sequence, time, published = MESSAGE_HEAD.unpack_from(body)
    return records.Message(channel, time, bytes(body[MESSAGE_HEAD.size :]), published, sequence)


def _check_crc(what: str, stated: int, parts: Iterable[bytes]) -> None:
    """Refuses content that has another CRC-32 than the file states; 0 states none."""
    if not stated:
        return
    found = 0
    for part in parts:
        found = crc32(part, found)
    if found != stated:
        raise ValueError(f"the checksum of {what} is wrong")
