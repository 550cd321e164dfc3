"""Reads bags in MCAP, with the interface of the library that reads the other storages."""

import heapq
from array import array
from collections import Counter
from collections.abc import Collection, Container, Iterator, Sequence
from contextlib import ExitStack, contextmanager
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, BinaryIO, NamedTuple

import numpy as np
from mcap.opcode import Opcode
from mcap.records import Attachment, Channel, Chunk, ChunkIndex, Message, Metadata, Schema

from derain.bags.mcap_records import McapRecords

# Bytes that messages of chunks that overlap in time may take together.
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


class ChunkPlace(NamedTuple):
    """The place of a chunk.

    Attributes:
        start: The earliest time in it, nanoseconds.
        end: The latest.
        offset: Of its record in the file.
        channels: Those in it; None where the file does not list them.
        compression: ``""``, ``lz4`` or ``zstd``.
    """

    start: int
    end: int
    offset: int
    channels: frozenset[int] | None
    compression: str


class McapFile:
    """A file of MCAP.

    A file whose summary is missing or incomplete is read through once.

    Args:
        file: The file, open.

    Attributes:
        records: Its records by their places.
        schemas: Its schemas by their numbers.
        channels: Its channels by their numbers.
        counts: Number of messages of each channel.
        start: The earliest time of a message, nanoseconds.
        end: The latest.
        chunks: Places of the chunks.

    Raises:
        ValueError: A damaged file.
        OSError: It cannot be read.
    """

    def __init__(self, file: BinaryIO) -> None:
        self.records = McapRecords(file)
        self.schemas: dict[int, Schema] = {}
        self.channels: dict[int, Channel] = {}
        self.counts: Counter[int] = Counter()
        self.start, self.end = 2**63 - 1, 0
        self.chunks: list[ChunkPlace] = []
        # Times and places of messages that are in no chunk.
        self._times, self._offsets = array("Q"), array("Q")
        if not self._read_summary():
            self._scan()

    def connections(self) -> dict[int, McapConnection]:
        """Its channels by their numbers, without the counts of their messages.

        Raises:
            ValueError: A channel of a type that is not defined.
        """
        found = {}
        for number, channel in self.channels.items():
            schema = self.schemas.get(channel.schema_id)
            if schema is None and channel.schema_id:
                raise ValueError(f"{channel.topic} has an undefined type")
            name = "" if schema is None else schema.name
            found[number] = McapConnection(
                channel.topic,
                _long_name(name),
                channel.message_encoding,
                tuple(channel.metadata.items()),
                None if schema is None else (name, schema.encoding, bytes(schema.data)),
            )
        return found

    def messages(self, channels: Container[int], start: int = 0) -> Iterator[Message]:
        """Messages in the order of their times; of one time, in the order of the file.

        Args:
            channels: Those of interest. If they are all of the file, a message of a channel that it
                does not define is damage, and is not left out.
            start: The first time of interest, nanoseconds.

        Raises:
            ValueError: A damaged file.
        """
        whole = all(number in channels for number in self.channels)
        parts = (part(channels, start, whole) for part in (self._in_chunks, self._outside_chunks))
        for _, _, message in heapq.merge(*parts, key=lambda found: found[:2]):
            yield message

    def check_whole(self) -> None:
        """Checks that reading all messages leaves nothing of the file unread.

        Raises:
            ValueError: A wrong checksum of the data, or a summary that differs from them in chunks,
                messages, channels or schemas.
        """
        chunks, messages = set(), 0
        for kind, offset, _ in self.records.places():
            if kind == Opcode.CHUNK:
                chunks.add(offset)
            elif kind == Opcode.MESSAGE:
                messages += 1
            elif kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(self.records.read(offset, kind))
            elif kind == Opcode.DATA_END:
                self.records.check_data(offset)
        if chunks != {chunk.offset for chunk in self.chunks}:
            raise ValueError("its summary does not match its chunks")
        if messages != len(self._times):
            raise ValueError(f"its summary lacks {messages:,} messages that are in no chunk")

    def _read_summary(self) -> bool:
        """Reads the summary, and returns whether it locates every message."""
        statistics, chunks = None, list[ChunkPlace]()
        for kind, record in self.records.in_summary():
            if kind == Opcode.CHUNK_INDEX:
                channels = frozenset(record.message_index_offsets) or None
                chunks.append(_place_of(record, record.chunk_start_offset, channels))
            elif kind == Opcode.STATISTICS:
                statistics = record
            else:
                self._define(record)
        if len({chunk.offset for chunk in chunks}) < len(chunks):
            raise ValueError("its summary names a chunk more than once")
        if statistics is None or len(chunks) != statistics.chunk_count:
            return False
        counts = Counter(statistics.channel_message_counts)
        if not counts.keys() <= self.channels.keys() or (statistics.message_count and not chunks):
            return False
        self.counts, self.chunks = counts, chunks
        self.start, self.end = statistics.message_start_time, statistics.message_end_time
        return True

    def _scan(self) -> None:
        """Reads through the whole file."""
        for kind, offset, _ in self.records.places():
            if kind == Opcode.CHUNK:
                chunk, channels = self.records.read(offset, kind), set()
                for inner, record in self.records.in_chunk(chunk):
                    if inner == Opcode.MESSAGE:
                        self._count(record)
                        channels.add(record.channel_id)
                    else:
                        self._define(record)
                self.chunks.append(_place_of(chunk, offset, frozenset(channels)))
            elif kind == Opcode.MESSAGE:
                message = self.records.read(offset, kind)
                self._count(message)
                self._times.append(message.log_time)
                self._offsets.append(offset)
            elif kind in (Opcode.SCHEMA, Opcode.CHANNEL):
                self._define(self.records.read(offset, kind))

    def _count(self, message: Message) -> None:
        self.counts[message.channel_id] += 1
        self.start, self.end = min(self.start, message.log_time), max(self.end, message.log_time)

    def _define(self, record: Any) -> None:
        """Notes a schema or a channel; a second one of its number must be the same."""
        defined: dict[type, dict[int, Any]] = {Schema: self.schemas, Channel: self.channels}
        known = defined.get(type(record))
        if known is not None and known.setdefault(record.id, record) != record:
            raise ValueError(f"it defines {type(record).__name__.lower()} {record.id} in two ways")

    def _in_chunks(
        self, channels: Container[int], start: int, whole: bool
    ) -> Iterator[tuple[int, int, Message]]:
        """Time, chunk and message; a chunk is unpacked when its time has come."""
        waiting: list[tuple[int, int, int, Message | None]] = [
            (chunk.start, chunk.offset, -1, None)
            for chunk in self.chunks
            if chunk.end >= start
            and (whole or chunk.channels is None or any(c in channels for c in chunk.channels))
        ]
        heapq.heapify(waiting)
        held = 0
        while waiting:
            time, offset, _, message = heapq.heappop(waiting)
            if message is not None:
                held -= len(message.data)
                yield time, offset, message
                continue
            parts = self.records.in_chunk(self.records.read(offset, Opcode.CHUNK))
            for number, (kind, record) in enumerate(parts):
                if kind != Opcode.MESSAGE:
                    self._define(record)
                    if whole and kind not in (Opcode.SCHEMA, Opcode.CHANNEL):
                        raise ValueError(f"a chunk holds a record that no chunk has (kind {kind})")
                elif record.channel_id in channels:
                    if record.log_time >= start:
                        held += len(record.data)
                        heapq.heappush(waiting, (record.log_time, offset, number, record))
                elif whole:
                    raise _undefined(record)
            if held > MOST_HELD:
                raise ValueError(
                    f"messages of more than {MOST_HELD // 10**6} MB in chunks of one time"
                )

    def _outside_chunks(
        self, channels: Container[int], start: int, whole: bool
    ) -> Iterator[tuple[int, int, Message]]:
        """Time, place and message of those that are in no chunk."""
        for index in np.argsort(np.asarray(self._times), kind="stable"):
            if self._times[index] >= start:
                offset = self._offsets[index]
                message = self.records.read(offset, Opcode.MESSAGE)
                if message.channel_id in channels:
                    yield message.log_time, offset, message
                elif whole:
                    raise _undefined(message)


@dataclass(frozen=True, eq=False)
class McapReader:
    """The files of a bag in MCAP.

    Attributes:
        files: The files, open, in the order of time.
    """

    files: Sequence[McapFile]

    @property
    def connections(self) -> list[McapConnection]:
        """Its connections, in the order of the files."""
        counts = Counter[McapConnection]()
        for file in self.files:
            for number, connection in file.connections().items():
                counts[connection] += file.counts[number]
        return [replace(each, msgcount=count) for each, count in counts.items()]

    @property
    def message_count(self) -> int:
        """Number of messages."""
        return sum(file.counts.total() for file in self.files)

    @property
    def start_time(self) -> int:
        """Time at which the first message was recorded, nanoseconds; 0 where there is none."""
        return min((file.start for file in self.files if file.counts.total()), default=0)

    @property
    def duration(self) -> int:
        """Nanoseconds from the first to the last message."""
        last = max((file.end for file in self.files if file.counts.total()), default=0)
        return last - self.start_time

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
            channels = {n: each for n, each in file.connections().items() if each in wanted}
            for found in file.messages(channels, start or 0):
                connection = channels[found.channel_id]
                yield connection, found.log_time, found.data, found.publish_time, found.sequence

    def stored_messages(self) -> int:
        """Number of messages in the files, after a check that each of them can be read.

        Raises:
            ValueError: As for McapFile.check_whole.
        """
        for file in self.files:
            file.check_whole()
        return self.message_count

    def attachments_and_metadata(self) -> Iterator[Attachment | Metadata]:
        """Every record that is neither a message nor about messages.

        Raises:
            ValueError: One is damaged.
        """
        for file in self.files:
            for kind, offset, _ in file.records.places():
                if kind in (Opcode.ATTACHMENT, Opcode.METADATA):
                    yield file.records.read(offset, kind)


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


def _place_of(
    record: Chunk | ChunkIndex, offset: int, channels: frozenset[int] | None
) -> ChunkPlace:
    times = record.message_start_time, record.message_end_time
    return ChunkPlace(*times, offset, channels, record.compression)


def _undefined(message: Message) -> ValueError:
    return ValueError(f"a message is of channel {message.channel_id}, which is not defined")


def _long_name(type_: str) -> str:
    """The name of a type as ROS 2 has it."""
    package, _, name = type_.rpartition("/")
    return f"{package}/msg/{name}" if package and "/" not in package else type_
