"""One file of MCAP: its channels, and its messages in the order of time."""

import heapq
from array import array
from collections import Counter
from collections.abc import Container, Iterator
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np

from derain.bags.mcap_records import (
    ATTACHMENT,
    CHANNEL,
    CHUNK,
    CHUNK_INDEX,
    DATA_END,
    MESSAGE,
    METADATA,
    SCHEMA,
    STATISTICS,
    McapMessage,
    McapRecords,
)

# What messages of chunks that overlap in time may take together, bytes.
MOST_HELD = 2**29


class ChunkPlace(NamedTuple):
    """Where a chunk is.

    Attributes:
        start: The earliest time in it, nanoseconds.
        end: The latest.
        offset: Of its record in the file.
        channels: Those in it; None where nobody says.
        compression: How it is packed.
    """

    start: int
    end: int
    offset: int
    channels: frozenset[int] | None
    compression: str


class McapFile:
    """A file of MCAP, open.

    Its summary tells where everything is; where it does not, the file is gone through once.

    Args:
        path: The file.

    Attributes:
        records: Its records by their places.
        schemas: Records of schemas, by number.
        channels: Records of channels, by number.
        counts: Messages by channel.
        start: The earliest time of a message, nanoseconds.
        end: The latest.
        chunks: Where chunks are.

    Raises:
        ValueError: A damaged file.
        OSError: It cannot be read.
    """

    def __init__(self, path: Path) -> None:
        self.records = McapRecords(path)
        self.schemas: dict[int, Any] = {}
        self.channels: dict[int, Any] = {}
        try:
            self._forget_messages()
            if not self._read_summary():
                self._forget_messages()
                self._scan()
        except BaseException:
            self.close()
            raise

    def close(self) -> None:
        """Closes the file."""
        self.records.close()

    def messages(self, channels: Container[int], start: int | None = None) -> Iterator[McapMessage]:
        """Messages in the order of their times; of one time, in the order of the file.

        Args:
            channels: Those of interest.
            start: The first time of interest, nanoseconds; None for the beginning.

        Raises:
            ValueError: A damaged file, or one that has other messages than it says.
        """
        parts = self._in_chunks(channels, start or 0), self._in_none(channels, start or 0)
        count = 0
        for _, _, message in heapq.merge(*parts, key=lambda found: found[:2]):
            count += 1
            yield message
        told = sum(n for channel, n in self.counts.items() if channel in channels)
        if start is None and count != told:
            raise ValueError(f"it has {count:,} messages where its index says {told:,}")

    def check_whole(self) -> None:
        """Checks that reading all messages leaves nothing of the file unread.

        Raises:
            ValueError: A wrong checksum of the data, or a summary that differs from them in chunks,
                messages, channels or schemas.
        """
        chunks, messages = set(), 0
        for place in self.records.places():
            if place.kind == CHUNK:
                chunks.add(place.offset)
            elif place.kind == MESSAGE:
                messages += 1
            elif place.kind in (SCHEMA, CHANNEL):
                self._learn(place.kind, self.records.read(place.offset, place.kind))
            elif place.kind == DATA_END:
                self.records.check_data(place)
        if chunks != {chunk.offset for chunk in self.chunks}:
            raise ValueError("its summary names other chunks than there are")
        if messages != len(self._times):
            raise ValueError(f"its summary lacks {messages:,} messages that are in no chunk")

    def attachments_and_metadata(self) -> Iterator[tuple[int, Any]]:
        """Kind and content of every record that is neither a message nor about messages.

        Raises:
            ValueError: A damaged file.
        """
        for place in list(self.records.places()):
            if place.kind in (ATTACHMENT, METADATA):
                yield place.kind, self.records.read(place.offset, place.kind)

    def _forget_messages(self) -> None:
        self.counts: Counter[int] = Counter()
        self.start, self.end = 2**63 - 1, 0
        self.chunks: list[ChunkPlace] = []
        # Times and places of messages that are in no chunk.
        self._times, self._offsets = array("Q"), array("Q")

    def _read_summary(self) -> bool:
        """Reads the summary; whether it tells where every message is."""
        statistics = None
        for kind, record in self.records.in_summary():
            if kind == CHUNK_INDEX:
                place = record.chunk_start_offset
                channels = frozenset(record.message_index_offsets) or None
                self._add_chunk(record, place, channels)
            elif kind == STATISTICS:
                statistics = record
            else:
                self._learn(kind, record)
        if len({chunk.offset for chunk in self.chunks}) < len(self.chunks):
            raise ValueError("its summary names a chunk more than once")
        if statistics is None or len(self.chunks) != statistics.chunk_count:
            return False
        self.counts.update(statistics.channel_message_counts)
        self.start, self.end = statistics.message_start_time, statistics.message_end_time
        if not self.counts.keys() <= self.channels.keys():
            return False
        return bool(self.chunks) or not statistics.message_count

    def _scan(self) -> None:
        """Goes through the whole file."""
        for kind, offset, _ in self.records.places():
            if kind == CHUNK:
                chunk, channels = self.records.read(offset, kind), set()
                for inner, record in self.records.in_chunk(chunk):
                    if inner == MESSAGE:
                        self._count(record)
                        channels.add(record.channel)
                    else:
                        self._learn(inner, record)
                self._add_chunk(chunk, offset, frozenset(channels))
            elif kind == MESSAGE:
                message = self.records.read(offset, kind)
                self._count(message)
                self._times.append(message.time)
                self._offsets.append(offset)
            elif kind in (SCHEMA, CHANNEL):
                self._learn(kind, self.records.read(offset, kind))

    def _count(self, message: McapMessage) -> None:
        self.counts[message.channel] += 1
        self.start, self.end = min(self.start, message.time), max(self.end, message.time)

    def _learn(self, kind: int, record: Any) -> None:
        """Takes a schema or a channel; all of one number must be the same, wherever they are."""
        if kind in (SCHEMA, CHANNEL):
            known = self.schemas if kind == SCHEMA else self.channels
            if known.setdefault(record.id, record) != record:
                name = type(record).__name__.lower()
                raise ValueError(f"it defines {name} {record.id} in two ways")

    def _add_chunk(self, record: Any, offset: int, channels: frozenset[int] | None) -> None:
        times = record.message_start_time, record.message_end_time
        self.chunks.append(ChunkPlace(*times, offset, channels, record.compression))

    def _in_chunks(
        self, channels: Container[int], start: int
    ) -> Iterator[tuple[int, int, McapMessage]]:
        """Time, chunk and message; a chunk is unpacked when its time has come."""
        whole = self._are_all(channels)
        waiting: list[tuple[int, int, int, McapMessage | None]] = [
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
            parts = self.records.in_chunk(self.records.read(offset, CHUNK))
            for number, (kind, record) in enumerate(parts):
                if kind != MESSAGE:
                    self._learn(kind, record)
                    if whole and kind not in (SCHEMA, CHANNEL):
                        raise ValueError(f"a chunk holds a record that no chunk has (kind {kind})")
                elif record.channel in channels:
                    if record.time >= start:
                        held += len(record.data)
                        heapq.heappush(waiting, (record.time, offset, number, record))
                elif whole:
                    raise _stray(record)
            if held > MOST_HELD:
                raise ValueError(
                    f"messages of more than {MOST_HELD // 10**6} MB in chunks of one time"
                )

    def _in_none(
        self, channels: Container[int], start: int
    ) -> Iterator[tuple[int, int, McapMessage]]:
        """The same of messages that are in no chunk."""
        whole = self._are_all(channels)
        for place in np.argsort(np.asarray(self._times), kind="stable"):
            if self._times[place] >= start:
                offset = self._offsets[place]
                message = self.records.read(offset, MESSAGE)
                if message.channel in channels:
                    yield message.time, offset, message
                elif whole:
                    raise _stray(message)

    def _are_all(self, channels: Container[int]) -> bool:
        """Whether all messages are asked for, so that none may be left out."""
        return all(number in channels for number in self.channels)


def _stray(message: McapMessage) -> ValueError:
    return ValueError(f"a message is of channel {message.channel}, which nothing defines")
