"""Reads bags in MCAP, with the interface of the library that reads the other storages.

The library of MCAP's makers parses the records. Chunks are unpacked here, for the library has no
bound on what one of lz4 unpacks to. A file is read by its index.

Source: the MCAP specification, version 0 (https://mcap.dev/spec).
"""

import heapq
import os
from array import array
from collections import Counter, defaultdict
from collections.abc import Collection, Container, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from functools import cached_property
from itertools import pairwise
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np
from mcap.opcode import Opcode
from mcap.reader import FOOTER_SIZE
from mcap.records import (
    Attachment,
    AttachmentIndex,
    Channel,
    Chunk,
    ChunkIndex,
    DataEnd,
    Footer,
    Header,
    Message,
    Metadata,
    MetadataIndex,
    Schema,
    Statistics,
)
from mcap.stream_reader import StreamReader, get_chunk_data_stream

from derain.bags.unpacking import check_size, unpack

MAGIC = b"\x89MCAP0\r\n"

# Bytes of a message's record before its data: kind and size; channel, number and times.
MESSAGE_HEAD = 9 + 22

# Bytes that chunks that overlap in time may unpack to together.
MOST_HELD = 2**29


@dataclass(frozen=True)
class McapConnection:
    """A topic of one publisher; equal for publishers that a file describes alike.

    Attributes:
        topic: Name of the topic.
        msgtype: Type of its messages, such as ``sensor_msgs/msg/PointCloud2``.
        encoding: Name of the encoding, such as ``cdr``.
        notes: Names and values of the channel's metadata, such as quality of service.
        schema: Name, encoding and content of the definition of the type; None without one.
        msgcount: Number of messages, over all files; it does not make a connection another one.
    """

    topic: str
    msgtype: str
    encoding: str
    notes: tuple[tuple[str, str], ...]
    schema: tuple[str, str, bytes] | None
    msgcount: int = field(default=0, compare=False)


class McapFile:
    """A file of MCAP.

    Args:
        file: The file, open.

    Attributes:
        profile: The header's name for the kind of recording, such as ``ros2``.
        connections: Its channels by their numbers, without the counts of their messages.
        chunks: The index of its chunks, in the order of the file.
        statistics: Its numbers of records, and its times.

    Raises:
        ValueError: No MCAP, one that is cut off or damaged, or one without a whole index.
        OSError: It cannot be read.
    """

    def __init__(self, file: BinaryIO) -> None:
        self._file = file
        self._size = os.fstat(file.fileno()).st_size
        self._held = 0
        end = max(self._size - len(MAGIC), 0)
        for place in (0, end):
            file.seek(place)
            if file.read(len(MAGIC)) != MAGIC:
                raise ValueError("it does not begin and end with the magic bytes of MCAP")
        self.profile: str = self._read(len(MAGIC), Header).profile
        footer_at = end - FOOTER_SIZE
        summary = defaultdict[type, list[Any]](list)
        summary_at = self._read(footer_at, Footer).summary_start or footer_at
        if summary_at > footer_at:
            raise ValueError("its summary is in the wrong place")
        for record in self._records(summary_at):
            summary[type(record)].append(record)
        schemas = {each.id: each for each in summary[Schema]}
        self.connections = {
            each.id: _connection(each, schemas.get(each.schema_id)) for each in summary[Channel]
        }
        # By their places, for what is named twice would be read again and again.
        chunks = {each.chunk_start_offset: each for each in summary[ChunkIndex]}
        self.chunks: list[ChunkIndex] = [chunks[offset] for offset in sorted(chunks)]
        self._others = {each.offset: (Attachment, each) for each in summary[AttachmentIndex]}
        self._others |= {each.offset: (Metadata, each) for each in summary[MetadataIndex]}
        spans = [(each.chunk_start_offset, each.chunk_length) for each in self.chunks]
        spans += [(offset, each.length) for offset, (_, each) in self._others.items()]
        for (offset, length), (following, _) in pairwise(sorted(spans)):
            if offset + length > following:
                raise ValueError("records of its index overlap")
        if not summary[Statistics]:
            raise ValueError("it has no index")
        self.statistics: Statistics = summary[Statistics][0]
        others = self.statistics.attachment_count + self.statistics.metadata_count
        counted = self.statistics.channel_message_counts.keys()
        if (
            len(chunks) != self.statistics.chunk_count
            or len(self._others) != others
            or not counted <= self.connections.keys()
        ):
            raise ValueError("its index is not whole")

    def messages(self, channels: Container[int], start: int = 0) -> Iterator[Message]:
        """Messages in the order of their times; of one time, in the order of the file.

        Args:
            channels: Those of interest.
            start: The first time of interest, nanoseconds.

        Raises:
            ValueError: A damaged file.
        """
        parts = [
            self._in_chunk(index, channels, start)
            for index in self.chunks
            if index.message_end_time >= start and _may_hold(index, channels)
        ]
        if not self.chunks:
            parts = [self._outside_chunks(channels, start)]
        for _, message in heapq.merge(*parts, key=lambda found: found[0]):
            if message is not None:
                yield message

    def attachments_and_metadata(self) -> Iterator[Attachment | Metadata]:
        """Every record that is neither a message nor about messages.

        Raises:
            ValueError: The index names a place that has none.
        """
        for offset, (kind, index) in self._others.items():
            yield self._read(offset, kind, index.length)

    def _records(self, offset: int) -> Iterator[Any]:
        """Records from a place on; chunks are not unpacked."""
        self._file.seek(offset)
        reader = StreamReader(
            self._file, skip_magic=True, emit_chunks=True, record_size_limit=self._size
        )
        return reader.records

    def _read(self, offset: int, kind: type, length: int | None = None) -> Any:
        """The record at a place.

        Args:
            offset: The place.
            kind: Its kind.
            length: The most bytes that it may have; None for any number.

        Raises:
            ValueError: One of another kind, or a longer one.
        """
        record = next(self._records(offset))
        is_longer = length is not None and self._file.tell() > offset + length
        if is_longer or not isinstance(record, kind):
            raise ValueError(f"it has no {kind.__name__.lower()} at byte {offset:,} as indexed")
        return record

    def _in_chunk(
        self, index: ChunkIndex, channels: Container[int], start: int
    ) -> Iterator[tuple[int, Message | None]]:
        """Time and message; the first is None, so that no chunk is unpacked before its time."""
        yield index.message_start_time, None
        chunk = self._read(index.chunk_start_offset, Chunk, index.chunk_length)
        size = chunk.uncompressed_size
        check_size(size)
        self._held += size
        try:
            if self._held > MOST_HELD:
                raise ValueError(
                    f"more than {MOST_HELD // 10**6} MB are in chunks that overlap in time"
                )
            found = [
                (message.log_time, message)
                for message in _unpacked(chunk)
                if message.channel_id in channels and message.log_time >= start
            ]
            yield from sorted(found, key=lambda each: each[0])
        finally:
            self._held -= size

    def _outside_chunks(
        self, channels: Container[int], start: int
    ) -> Iterator[tuple[int, Message | None]]:
        """Time and message of a file without chunks."""
        times, offsets = self._places
        for place in np.argsort(times, kind="stable"):
            if times[place] >= start:
                message = self._read(offsets[place], Message)
                if message.channel_id in channels:
                    yield message.log_time, message

    @cached_property
    def _places(self) -> tuple["array[int]", "array[int]"]:
        """Time and offset of each message of a file without chunks, which has no index of them."""
        times, offsets = array("Q"), array("Q")
        for record in self._records(len(MAGIC)):
            if isinstance(record, Message):
                times.append(record.log_time)
                offsets.append(self._file.tell() - len(record.data) - MESSAGE_HEAD)
            elif isinstance(record, DataEnd):
                break
        return times, offsets


class McapReader:
    """The files of a bag in MCAP.

    Args:
        files: The files, open, in the order of time.

    Attributes:
        connections: Its connections, in the order of the files.
        message_count: Number of messages.
        start_time: Time of recording of the first message, nanoseconds; 0 where there is none.
        duration: Nanoseconds from the first to the last message.
    """

    def __init__(self, files: Sequence[McapFile]) -> None:
        self.files = files
        counts = Counter[McapConnection]()
        for file in files:
            for number, connection in file.connections.items():
                counts[connection] += file.statistics.channel_message_counts.get(number, 0)
        self.connections = [replace(each, msgcount=count) for each, count in counts.items()]
        filled = [file.statistics for file in files if file.statistics.message_count]
        self.message_count: int = sum(each.message_count for each in filled)
        self.start_time: int = min((each.message_start_time for each in filled), default=0)
        end = max((each.message_end_time for each in filled), default=0)
        self.duration: int = end - self.start_time

    def messages(
        self, connections: Collection[McapConnection], start: int | None = None
    ) -> Iterator[tuple[McapConnection, int, bytes, int, int]]:
        """Messages in the order of time within a file, and file after file.

        Args:
            connections: Those of interest.
            start: The first time of interest, nanoseconds; None for the beginning.

        Yields:
            Connection, time of recording in nanoseconds, bytes, time of publication in nanoseconds,
            and number as the publisher counts.

        Raises:
            ValueError: A damaged file.
        """
        wanted = set(connections)
        for file in self.files:
            channels = {n: each for n, each in file.connections.items() if each in wanted}
            for found in file.messages(channels, start or 0):
                connection = channels[found.channel_id]
                yield connection, found.log_time, found.data, found.publish_time, found.sequence

    def attachments_and_metadata(self) -> Iterator[Attachment | Metadata]:
        """Those of all files; see :meth:`McapFile.attachments_and_metadata`."""
        for file in self.files:
            yield from file.attachments_and_metadata()


@contextmanager
def mcap_reader(paths: Sequence[Path]) -> Iterator[McapReader]:
    """Lends a reader of the files of a bag, open.

    Args:
        paths: Its files, in the order of time.

    Raises:
        ValueError: A damaged file.
        OSError: One cannot be read.
    """
    with ExitStack() as stack:
        opened = [stack.enter_context(path.open("rb")) for path in paths]
        yield McapReader([McapFile(file) for file in opened])


def _connection(channel: Channel, schema: Schema | None) -> McapConnection:
    """The connection of a channel.

    Raises:
        ValueError: A channel of a type that is not defined.
    """
    if schema is None and channel.schema_id:
        raise ValueError(f"{channel.topic} has an undefined type")
    name = "" if schema is None else schema.name
    return McapConnection(
        channel.topic,
        _long_name(name),
        channel.message_encoding,
        tuple(channel.metadata.items()),
        None if schema is None else (name, schema.encoding, bytes(schema.data)),
    )


def _may_hold(index: ChunkIndex, channels: Container[int]) -> bool:
    """True if a chunk has messages of some channels, or does not list its channels."""
    inside = index.message_index_offsets
    return not inside or any(channel in channels for channel in inside)


def _unpacked(chunk: Chunk) -> Iterator[Message]:
    """The messages of a chunk.

    Raises:
        ValueError: It is damaged, or unpacks to other than it states.
    """
    content = unpack(chunk.data, chunk.compression)
    if len(content) != chunk.uncompressed_size:
        raise ValueError(
            f"a chunk states {chunk.uncompressed_size:,} bytes, and unpacks to {len(content):,}"
        )
    plain = replace(chunk, compression="", data=content)
    stream, size = get_chunk_data_stream(plain, validate_crc=True)
    # The time of each message differs, so a chunk that unpacks to more records than it has bytes is
    # made to fill the memory.
    for _ in range(len(chunk.data)):
        if stream.count >= size:
            return
        kind, length = stream.read1(), stream.read8()
        if kind == Opcode.MESSAGE:
            yield Message.read(stream, length)
        else:
            stream.read(length)
    if stream.count < size:
        raise ValueError(f"a chunk of {len(chunk.data):,} bytes has more records than that")


def _long_name(type_: str) -> str:
    """The name of a type as ROS 2 has it."""
    package, _, name = type_.rpartition("/")
    return f"{package}/msg/{name}" if package and "/" not in package else type_
