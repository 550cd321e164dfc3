"""The records of an MCAP file, by their places in it.

They are those of the library of MCAP's makers, which parses and writes them. What a file says of
sizes is checked before anything is read or unpacked.

Source: the MCAP specification, version 0 (https://mcap.dev/spec).
"""

import os
import struct
from collections.abc import Iterator
from io import BytesIO
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple
from zlib import crc32

from derain.bags.unpacking import check_size, unpack
from derain.system.extras import MCAP

MAGIC = b"\x89MCAP0\r\n"

HEADER, FOOTER, SCHEMA, CHANNEL, MESSAGE, CHUNK = range(1, 7)
CHUNK_INDEX, ATTACHMENT, STATISTICS, METADATA = 8, 9, 11, 12
DATA_END = 15

# Kinds that the specification defines; those from 0x80 on are private records of an application.
SPECIFIED = range(1, DATA_END + 1)

# What the library calls those that it is asked for.
RECORD_NAMES = {
    HEADER: "Header",
    SCHEMA: "Schema",
    CHANNEL: "Channel",
    CHUNK: "Chunk",
    CHUNK_INDEX: "ChunkIndex",
    ATTACHMENT: "Attachment",
    STATISTICS: "Statistics",
    METADATA: "Metadata",
}

# A record begins with its kind and the bytes that follow; a message with its channel, its number,
# and when it was recorded and published. A footer has two places and a checksum.
HEAD, MESSAGE_HEAD = struct.Struct("<BQ"), struct.Struct("<HIQQ")
FOOTER_BODY, CHECKSUM = struct.Struct("<QQI"), struct.Struct("<I")

# What is read at once of a file whose checksum is computed, bytes.
PORTION = 2**22


class Place(NamedTuple):
    """Where a record is.

    Attributes:
        kind: Its kind.
        offset: Of its first byte.
        size: Bytes after its head.
    """

    kind: int
    offset: int
    size: int


class McapMessage(NamedTuple):
    """One message.

    Attributes:
        channel: Number of its channel, within the file.
        sequence: Its number, as the publisher counts.
        time: When it was recorded, nanoseconds.
        published: When it was published, nanoseconds.
        data: Its bytes.
    """

    channel: int
    sequence: int
    time: int
    published: int
    data: bytes

    @classmethod
    def parse(cls, body: bytes | memoryview) -> "McapMessage":
        """Reads the body of its record."""
        if len(body) < MESSAGE_HEAD.size:
            raise ValueError("a message is cut off")
        channel, sequence, time, published = MESSAGE_HEAD.unpack_from(body)
        return cls(channel, sequence, time, published, bytes(body[MESSAGE_HEAD.size :]))


class McapRecords:
    """An MCAP file, open.

    Args:
        path: The file.

    Attributes:
        data: Bytes from the first to the last of the data.
        summary: Bytes of the summary, which is after them; none where there is none.

    Raises:
        ValueError: No MCAP, or one that is cut off or damaged.
        OSError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self._library = MCAP.load(path, "records")
        self._stream = MCAP.load(path, "data_stream").ReadDataStream
        self._file: BinaryIO = path.open("rb")
        try:
            self._size = os.fstat(self._file.fileno()).st_size
            self._read_frame()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Closes the file."""
        self._file.close()

    def places(self) -> Iterator[Place]:
        """Where the records of the data are, without those within chunks."""
        return _places(self._file, *self.data)

    def private(self) -> Iterator[bytes]:
        """Private records of the data and of the summary, whole."""
        for begin, end in (self.data, self.summary):
            for place in _places(self._file, begin, end):
                if place.kind not in SPECIFIED:
                    yield self._bytes(place.offset, HEAD.size + place.size)

    def check_data(self, end: Place) -> None:
        """Compares the checksum of the data with their bytes, where the file has one.

        Args:
            end: The record that ends the data.

        Raises:
            ValueError: They differ.
        """
        (stated,) = CHECKSUM.unpack(self._body(end.offset, DATA_END))
        if not stated:
            return
        found = 0
        for start in range(0, end.offset, PORTION):
            found = crc32(self._bytes(start, min(PORTION, end.offset - start)), found)
        if found != stated:
            raise ValueError("the checksum of its data is wrong")

    def read(self, offset: int, kind: int) -> Any:
        """The record at a place.

        Raises:
            ValueError: There is none of that kind, or a damaged one.
        """
        body = self._body(offset, kind)
        if kind == MESSAGE:
            return McapMessage.parse(body)
        if kind == ATTACHMENT:
            (told,) = CHECKSUM.unpack(body[-CHECKSUM.size :])
            if told and crc32(body[: -CHECKSUM.size]) != told:
                raise ValueError("the checksum of an attachment is wrong")
        return self._parsed(kind, body)

    def in_summary(self) -> Iterator[tuple[int, Any]]:
        """Kind and content of the records of the summary that the library is asked for.

        Raises:
            ValueError: It is damaged.
        """
        begin, end = self.summary
        check_size(end - begin)
        content = self._bytes(begin, end - begin)
        if self._summary_checksum:
            footer = self._bytes(end, HEAD.size + FOOTER_BODY.size - CHECKSUM.size)
            if crc32(footer, crc32(content)) != self._summary_checksum:
                raise ValueError("the checksum of its summary is wrong")
        return self._parts(content, most=len(content))

    def in_chunk(self, chunk: Any) -> Iterator[tuple[int, Any]]:
        """The same of the records of a chunk.

        Raises:
            ValueError: It is damaged.
        """
        check_size(chunk.uncompressed_size)
        content = unpack(chunk.data, chunk.compression)
        if len(content) != chunk.uncompressed_size:
            raise ValueError(
                f"a chunk of {len(content):,} bytes says that it has {chunk.uncompressed_size:,}"
            )
        if chunk.uncompressed_crc and crc32(content) != chunk.uncompressed_crc:
            raise ValueError("the checksum of a chunk is wrong")
        return self._parts(content, most=len(chunk.data))

    def _parts(self, content: bytes, most: int) -> Iterator[tuple[int, Any]]:
        """Kind and content of each record; None is the content of private records.

        Args:
            content: The records.
            most: How many there may be. The time of each message differs, so a chunk that unpacks
                to more records than it has bytes is made to fill the memory.
        """
        view = memoryview(content)
        for number, (kind, offset, size) in enumerate(_places(BytesIO(content), 0, len(content))):
            if number >= most:
                raise ValueError(f"a chunk of {most:,} bytes unpacks to more records than that")
            body = view[offset + HEAD.size :][:size]
            if kind == MESSAGE:
                yield kind, McapMessage.parse(body)
            elif kind in RECORD_NAMES:
                yield kind, self._parsed(kind, bytes(body))
            elif kind not in SPECIFIED:
                yield kind, None

    def _read_frame(self) -> None:
        """Finds where the data and the summary are."""
        end = self._size - len(MAGIC)
        footer = end - FOOTER_BODY.size - HEAD.size
        if self._bytes(0, len(MAGIC)) != MAGIC:
            raise ValueError("it does not begin as MCAP does")
        if footer < len(MAGIC) or self._bytes(end, len(MAGIC)) != MAGIC:
            raise ValueError("it does not end as MCAP does")
        content = self._body(footer, FOOTER)
        if len(content) != FOOTER_BODY.size:
            raise ValueError("its footer is damaged")
        summary, _, self._summary_checksum = FOOTER_BODY.unpack(content)
        header = self._body(len(MAGIC), HEADER)
        self.profile = str(self._parsed(HEADER, header).profile)
        begin = len(MAGIC) + HEAD.size + len(header)
        if summary and not begin <= summary <= footer:
            raise ValueError("its summary is out of place")
        self.data = begin, summary or footer
        self.summary = summary or footer, footer

    def _body(self, offset: int, kind: int) -> bytes:
        found, size = HEAD.unpack(self._bytes(offset, HEAD.size))
        if found != kind:
            raise ValueError(f"another record than expected at byte {offset:,}")
        if kind != ATTACHMENT:  # which may be whatever somebody put into the file
            check_size(size)
        return self._bytes(offset + HEAD.size, size)

    def _bytes(self, offset: int, size: int) -> bytes:
        if offset < 0 or offset + size > self._size:
            raise ValueError(f"it ends before byte {offset + size:,}")
        self._file.seek(offset)
        return self._file.read(size)

    def _parsed(self, kind: int, body: bytes) -> Any:
        return getattr(self._library, RECORD_NAMES[kind]).read(self._stream(BytesIO(body)))


def _places(file: BinaryIO, begin: int, end: int) -> Iterator[Place]:
    """Where records are that come one after the other; each is within the end."""
    while begin < end:
        file.seek(begin)
        head = file.read(HEAD.size)
        if len(head) < HEAD.size:
            raise ValueError("a record is cut off")
        kind, size = HEAD.unpack(head)
        if begin + HEAD.size + size > end:
            raise ValueError(f"a record at byte {begin:,} says that it has {size:,} bytes")
        yield Place(kind, begin, size)
        begin += HEAD.size + size
