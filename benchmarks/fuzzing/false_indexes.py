"""Bags whose index or summary does not agree with the messages."""

import struct
from collections.abc import Callable, Iterable
from io import BytesIO

from mcap.data_stream import RecordBuilder
from mcap.records import ChunkIndex, Footer, McapRecord, Statistics, SummaryOffset
from mcap.stream_reader import StreamReader

MCAP_MAGIC = b"\x89MCAP0\r\n"
FOOTER_RECORD = struct.Struct("<BQQQI")


def with_summary(file: bytes, change: Callable[[list[McapRecord]], Iterable[McapRecord]]) -> bytes:
    """An MCAP file with another summary, which has no checksum.

    Args:
        file: The file.
        change: Makes the records of the summary out of those that there are.
    """
    return summarised(file[: _summary_start(file)], change(summary_of(file)))


def summary_of(file: bytes) -> list[McapRecord]:
    """The records of the summary of an MCAP file."""
    records = StreamReader(BytesIO(file[_summary_start(file) :]), skip_magic=True).records
    return [each for each in records if not isinstance(each, (Footer, SummaryOffset))]


def summarised(data: bytes, summary: Iterable[McapRecord]) -> bytes:
    """An MCAP file of its data, from the magic bytes on, and the records of its summary."""
    builder = RecordBuilder()
    for each in summary:
        each.write(builder)
    Footer(len(data), 0, 0).write(builder)
    return data + builder.end() + MCAP_MAGIC


def _summary_start(file: bytes) -> int:
    footer = len(file) - len(MCAP_MAGIC) - FOOTER_RECORD.size
    return int(FOOTER_RECORD.unpack_from(file, footer)[2])


def stating(messages: int) -> Callable[[list[McapRecord]], list[McapRecord]]:
    """A summary that states so many messages of each channel."""

    def change(records: list[McapRecord]) -> list[McapRecord]:
        for each in records:
            if isinstance(each, Statistics):
                each.channel_message_counts = dict.fromkeys(each.channel_message_counts, messages)
                each.message_count = messages
        return records

    return change


def chunks_times(number: int) -> Callable[[list[McapRecord]], list[McapRecord]]:
    """A summary that names each chunk so many times, and counts its messages as often."""

    def change(records: list[McapRecord]) -> list[McapRecord]:
        for each in records:
            if isinstance(each, Statistics):
                counts = each.channel_message_counts
                each.channel_message_counts = {n: number * counts[n] for n in counts}
                each.chunk_count *= number
        return [r for each in records for r in [each] * (number if _is_chunk(each) else 1)]

    return change


def chunks_longer_by(number: int) -> Callable[[list[McapRecord]], list[McapRecord]]:
    """A summary that states so many more bytes of each chunk."""

    def change(records: list[McapRecord]) -> list[McapRecord]:
        for each in records:
            if isinstance(each, ChunkIndex):
                each.chunk_length += number
        return records

    return change


def without_a_chunk(records: list[McapRecord]) -> list[McapRecord]:
    """A summary that lacks the last chunk, and states as many messages as are left."""
    left_out = [each for each in records if _is_chunk(each)][-1]
    for each in records:
        if isinstance(each, Statistics):
            each.chunk_count -= 1
            for channel in left_out.message_index_offsets:
                each.channel_message_counts[channel] -= 1
    return [each for each in records if each is not left_out]


def ros1_with_index(file: bytes, *, topics: int = 0, chunk_times: int = 1) -> bytes:
    """A bag of ROS 1 of one chunk, with more topics and that chunk named more often.

    Args:
        file: The bag.
        topics: How many topics without messages there are besides.
        chunk_times: How often the chunk is named.
    """
    (index,) = struct.unpack_from("<Q", file, file.index(b"index_pos=") + 10)
    chunk = file[file.rindex(b"\x04\0\0\0op=\x06") - 4 :]
    more = b"".join(_connection(1000 + number) for number in range(topics))
    made = bytearray(file[:index] + more + file[index:] + chunk * (chunk_times - 1))
    for field, number in ((b"conn_count=", topics), (b"chunk_count=", chunk_times - 1)):
        place = file.index(field) + len(field)
        (before,) = struct.unpack_from("<I", file, place)
        struct.pack_into("<I", made, place, before + number)
    return bytes(made)


def _connection(number: int) -> bytes:
    """A record of ROS 1 for a topic."""
    topic = b"/%d" % number
    head = {b"op": b"\x07", b"conn": struct.pack("<I", number), b"topic": topic}
    body = {b"topic": topic, b"type": b"a/B", b"md5sum": b"0" * 32, b"message_definition": b""}
    return _fields(head) + _fields(body)


def _fields(values: dict[bytes, bytes]) -> bytes:
    fields = b"".join(
        struct.pack("<I", len(name) + 1 + len(value)) + name + b"=" + value
        for name, value in values.items()
    )
    return struct.pack("<I", len(fields)) + fields


def _is_chunk(record: McapRecord) -> bool:
    return isinstance(record, ChunkIndex)
