"""Bags of every storage, read cloud by cloud and copied message by message."""

import bz2
import sqlite3
import struct
import tempfile
from collections.abc import Callable, Iterator, Sequence
from contextlib import closing, suppress
from functools import cache, partial
from io import BytesIO
from pathlib import Path
from random import Random
from typing import Any

import lz4.frame
import mcap.records
import mcap.writer
import zstandard
from mcap.data_stream import RecordBuilder

from benchmarks.fuzzing.false_indexes import (
    MCAP_MAGIC,
    chunks_times,
    ros1_with_index,
    stating,
    summarised,
    summary_of,
    with_summary,
)
from benchmarks.fuzzing.formats import BOMB, POINTS
from benchmarks.fuzzing.mutations import damaged
from benchmarks.fuzzing.reader import Reader
from benchmarks.recorded_bags import (
    CLOUD_TYPE,
    START,
    Recorded,
    Ros,
    Storage,
    drive,
    table_of,
    write_bag,
)
from derain.bags.bag_copy import BagCopy
from derain.bags.names import written_name
from derain.evaluation.hard_cases import scene
from derain.sources.bag_frame import clouds_at
from derain.sources.folders import named_frames

MILLION_ZEROS = bytes(10**6)

# More topics than a recording has, and than a database of derain's fuzzer takes long to make.
TOPICS = 30_000

# What a file of a storage is called.
FILES: dict[Storage, str] = {"ros1": "drive.bag", "sqlite3": "drive.db3", "mcap": "drive.mcap"}

# Wrong heads of clouds: rows, points in a row, bytes of a point and of a row.
LIES = (
    (1, 2**32 - 1, 16, 2**32 - 1),
    (2**32 - 1, 2**32 - 1, 16, 16),
    (2**32 - 1, 1, 1, 0),
    (1, 2**32 - 1, 0, 0),
    (1, 0, 2**32 - 1, 0),
    (2, POINTS // 2, 16, 0),
    (2, POINTS // 2, 2**31, 2**31),
)


def readers() -> list[Reader]:
    """One for each storage, and one for the metadata.yaml of a folder."""
    return [
        Reader("bag", "drive.bag", _read_bag, _ros1, _hostile_ros1(), _changed("ros1")),
        Reader("db3", "drive.db3", _read_bag, _sqlite3, _hostile_sqlite3(), _changed("sqlite3")),
        Reader("mcap", "drive.mcap", _read_bag, _mcap, _hostile_mcap(), _changed_mcap),
        Reader("bag.yaml", "metadata.yaml", _read_folder, _metadata, _hostile_metadata()),
    ]


def _read_bag(path: Path) -> None:
    """Reads all clouds, and copies the bag, as a run does."""
    frames = named_frames([path])
    for frame in frames:
        scan = frame.read()
        assert scan.xyz.shape == (len(scan), 3), scan.xyz.shape
    clouds, _ = clouds_at(path)
    with tempfile.TemporaryDirectory() as folder:
        target = Path(folder, written_name(clouds.bag.path, clouds.bag.path.is_file()))
        with BagCopy(clouds.bag, clouds.topic, target) as copy:
            made = copy.finish()
        assert len(named_frames([made])) == len(frames)


def _read_folder(path: Path) -> None:
    """Reads the folder of a metadata.yaml, beside which there is a sound file."""
    (path.parent / FILES["mcap"]).write_bytes(_mcap()[0])
    try:
        _read_bag(path.parent)
    finally:
        (path.parent / FILES["mcap"]).unlink()


@cache
def _ros(storage: Storage) -> Ros:
    return Ros(storage)


def _messages(storage: Storage) -> list[Recorded]:
    columns = dict(zip(("x", "y", "z", "intensity"), scene(POINTS).T, strict=True))
    return drive(_ros(storage), [table_of(columns)] * 2)


def _written(storage: Storage, messages: Sequence[Recorded]) -> bytes:
    """The file of a bag."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / (FILES["ros1"] if storage == "ros1" else "drive")
        write_bag(path, storage, messages)
        return (path if storage == "ros1" else path / FILES[storage]).read_bytes()


def _ros1() -> list[bytes]:
    return [_written("ros1", _messages("ros1")), _ros1_packed("bz2", bz2.compress)]


def _ros1_packed(compression: str, compress: Callable[[bytes], bytes]) -> bytes:
    """A bag of ROS 1 whose chunk is packed by a function."""
    from rosbags import rosbag1

    writer_of = rosbag1.Writer.__init__

    def packing(self: Any, path: Path) -> None:
        writer_of(self, path)
        self.compression_format, self.compressor = compression, compress

    try:
        rosbag1.Writer.__init__ = packing  # type: ignore[method-assign]
        return _written("ros1", _messages("ros1"))
    finally:
        rosbag1.Writer.__init__ = writer_of  # type: ignore[method-assign]


def _sqlite3() -> list[bytes]:
    return [_written("sqlite3", _messages("sqlite3"))]


@cache
def _mcap() -> list[bytes]:
    kinds = mcap.writer.CompressionType
    return [
        _written("mcap", _messages("mcap")),
        *(_mcap_by_makers(compression=kind) for kind in kinds),
        _mcap_by_makers(use_chunking=False),
    ]


def _mcap_by_makers(**options: Any) -> bytes:
    """A file as the library of MCAP's makers writes it, with an attachment and metadata."""
    file, ros = BytesIO(), _ros("mcap")
    writer = mcap.writer.Writer(file, chunk_size=500, **options)
    writer.start("ros2")
    channels: dict[str, int] = {}
    for number, each in enumerate(_messages("mcap")):
        if each.topic not in channels:
            schema = writer.register_schema(each.type, "ros2msg", b"")
            channels[each.topic] = writer.register_channel(each.topic, "cdr", schema)
        message = ros.to_bytes(each.message, each.type)
        writer.add_message(channels[each.topic], each.time, message, each.time - 1000, number)
    writer.add_attachment(START, START, "note.txt", "text/plain", b"a note")
    writer.add_metadata("trip", {"driver": "nobody"})
    writer.finish()
    return file.getvalue()


def _metadata() -> list[bytes]:
    with tempfile.TemporaryDirectory() as folder:
        path = write_bag(Path(folder) / "drive", "mcap", _messages("mcap"))
        return [(path / "metadata.yaml").read_bytes()]


def _changed(storage: Storage) -> Callable[[Random], bytes]:
    """Returns a function that makes a sound bag of a damaged cloud."""

    def change(generator: Random) -> bytes:
        ros, messages = _ros(storage), _messages(storage)
        cloud = ros.to_bytes(messages[3].message, CLOUD_TYPE)
        messages[3] = _with(messages[3], damaged(cloud, cloud, generator))
        return _written(storage, messages)

    return change


def _changed_mcap(generator: Random) -> bytes:
    """A damaged cloud, or a damaged chunk that has no checksum."""
    if generator.random() < 0.5:
        return _changed("mcap")(generator)
    content = _chunk_of(_mcap()[1])
    return _of_chunks([_chunk(damaged(content, content, generator))])


def _with(recorded: Recorded, message: bytes) -> Recorded:
    return Recorded(recorded.topic, recorded.type, recorded.time, message)


def _lying(storage: Storage, lie: tuple[int, int, int, int]) -> bytes:
    """A bag with a cloud whose header is wrong."""
    messages = _messages(storage)
    cloud = messages[3].message
    cloud.height, cloud.width, cloud.point_step, cloud.row_step = lie
    return _written(storage, messages)


def _lies(storage: Storage) -> list[Callable[[], bytes]]:
    return [partial(_lying, storage, lie) for lie in LIES]


def _hostile_ros1() -> list[Callable[[], bytes]]:
    return [
        *_lies("ros1"),
        lambda: _ros1_packed("bz2", lambda _: _bz2_bomb()),
        lambda: _ros1_packed("lz4", lambda _: _lz4_bomb()),
        lambda: _ros1_packed("lz4", lambda _: b""),
        lambda: ros1_with_index(_ros1()[0], topics=TOPICS),
        lambda: ros1_with_index(_ros1()[0], chunk_times=TOPICS),
    ]


def _hostile_sqlite3() -> list[Callable[[], bytes]]:
    enormous = "data BLOB GENERATED ALWAYS AS (zeroblob(999999999)) VIRTUAL"
    return [
        *_lies("sqlite3"),
        lambda: _database(f"CREATE TABLE messages(id INTEGER, topic_id, timestamp, {enormous})"),
        lambda: _database(
            "CREATE TABLE messages(id INTEGER, topic_id, timestamp, data)",
            "ALTER TABLE topics RENAME TO old",
            "CREATE TABLE topics(id INTEGER, name TEXT GENERATED ALWAYS AS (zeroblob(999999999)),"
            " type, serialization_format, offered_qos_profiles, type_description_hash)",
        ),
        lambda: _database(
            "CREATE VIEW messages AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT i + 1 FROM"
            " n) SELECT i AS id, 1 AS topic_id, i AS timestamp, zeroblob(100) AS data FROM n"
        ),
        _database_of_many_topics,
        lambda: _database(
            "CREATE TABLE messages(id INTEGER, topic_id, timestamp, data)",
            "DROP TABLE message_definitions",
            "CREATE VIEW message_definitions AS WITH RECURSIVE n(i) AS (SELECT 1 UNION ALL SELECT"
            " i + 1 FROM n) SELECT i AS id, i AS topic_type, 'ros2msg' AS encoding,"
            " '' AS encoded_message_definition, '' AS type_description_hash FROM n",
        ),
    ]


def _database(*statements: str) -> bytes:
    """A database whose table of messages is another."""
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.db3"
        path.write_bytes(_sqlite3()[0])
        database = sqlite3.connect(path)
        with suppress(sqlite3.Error):
            database.execute("DROP TABLE messages")
            for statement in statements:
                database.execute(statement)
            database.execute("INSERT INTO messages(id, topic_id, timestamp) VALUES (1, 1, 5)")
        database.commit()
        database.close()
        return path.read_bytes()


def _database_of_many_topics() -> bytes:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "drive.db3"
        path.write_bytes(_sqlite3()[0])
        with closing(sqlite3.connect(path)) as database, database:
            rows = [(1000 + n, f"/{n}", f"a/msg/B{n}", "cdr", "", "") for n in range(TOPICS)]
            database.executemany("INSERT INTO topics VALUES(?, ?, ?, ?, ?, ?)", rows)
            rows = [(1000 + n, f"a/msg/B{n}", "ros2msg", "", "") for n in range(TOPICS)]
            database.executemany("INSERT INTO message_definitions VALUES(?, ?, ?, ?, ?)", rows)
        return path.read_bytes()


def _hostile_mcap() -> list[Callable[[], bytes]]:
    content = partial(lambda: _chunk_of(_mcap()[1]))
    return [
        lambda: _of_chunks([_chunk(content(), _zstd_bomb(), "zstd")]),
        lambda: _of_chunks([_chunk(content(), _zstd_bomb(), "zstd", BOMB * 10**6)]),
        lambda: _of_chunks([_chunk(content(), _lz4_bomb(), "lz4")]),
        lambda: _of_chunks([_chunk(content(), content(), "", 2**63)]),
        lambda: _of_chunks([_heavy_chunk()] * 12),
        lambda: _of_chunks([struct.pack("<BQ", 5, 2**62)]),
        lambda: _of_chunks([struct.pack("<BQ", 6, 2**62)]),
        lambda: _of_chunks([_empty_messages()]),
        lambda: with_summary(_mcap()[1], stating(10**15)),
        lambda: with_summary(_mcap()[1], chunks_times(10_000)),
        lambda: with_summary(_mcap()[1], _with_channels),
    ]


def _with_channels(records: list[mcap.records.McapRecord]) -> list[mcap.records.McapRecord]:
    """A summary with many topics that have no messages."""
    return records + [
        mcap.records.Channel(1000 + number, f"/{number}", "cdr", {}, 0) for number in range(TOPICS)
    ]


def _hostile_metadata() -> list[Callable[[], bytes]]:
    def with_(old: bytes, new: bytes) -> bytes:
        return _metadata()[0].replace(old, new)

    return [
        lambda: with_(b"drive.mcap", b"../../etc/passwd"),
        lambda: with_(b"drive.mcap", b"/dev/zero"),
        lambda: with_(b"version: 8", b"version: 99999999999999999999"),
        lambda: b"rosbag2_bagfile_information: &a [*a, *a]",
        lambda: b"rosbag2_bagfile_information: " + b"[" * 500_000,
        lambda: b"rosbag2_bagfile_information: 1\n" + b"a: 1\n" * 3_000_000,
    ]


def _chunk_of(file: bytes) -> bytes:
    """The content of the first chunk of a file, which is not compressed."""
    start = 8
    while file[start] != 6:
        start += 9 + int.from_bytes(file[start + 1 : start + 9], "little")
    size = int.from_bytes(file[start + 25 : start + 33], "little")
    return file[start + 9 + 40 :][:size]


def _chunk(content: bytes, packed: bytes | None = None, by: str = "", size: int = -1) -> bytes:
    """A chunk without a checksum."""
    record, builder = mcap.records.Chunk, RecordBuilder()
    record(
        compression=by,
        data=content if packed is None else packed,
        message_end_time=START,
        message_start_time=START,
        uncompressed_crc=0,
        uncompressed_size=len(content) if size < 0 else size,
    ).write(builder)
    return builder.end()


@cache
def _heavy_chunk() -> bytes:
    """A chunk of a message of 100 MB, in a few kilobytes."""
    content = _chunk_of(_mcap()[1])
    # A message's channel, number and times.
    head = struct.pack("<HIQQ", 1, 0, START, START)
    message = struct.pack("<BQ", 5, len(head) + 10**8) + head + bytes(10**8)
    return _chunk(content + message, zstandard.compress(content + message), "zstd")


@cache
def _empty_messages() -> bytes:
    """A chunk of five million messages without data, in a few kilobytes."""
    message = struct.pack("<BQHIQQ", 5, 22, 1, 0, START, START)
    content = _chunk_of(_mcap()[1]) + message * 5_000_000
    return _chunk(content, zstandard.compress(content), "zstd")


def _of_chunks(chunks: Sequence[bytes]) -> bytes:
    """A file of chunks of one time, with the topics and the numbers of messages of a sound file."""
    builder = RecordBuilder()
    mcap.records.Header("ros2", "").write(builder)
    data = MCAP_MAGIC + builder.end()
    summary = [
        each
        for each in summary_of(_mcap()[1])
        if isinstance(each, mcap.records.Schema | mcap.records.Channel | mcap.records.Statistics)
    ]
    for chunk in chunks:
        summary.append(
            mcap.records.ChunkIndex(
                chunk_length=len(chunk),
                chunk_start_offset=len(data),
                compression="",
                compressed_size=0,
                message_end_time=START,
                message_index_length=0,
                message_index_offsets={},
                message_start_time=START,
                uncompressed_size=0,
            )
        )
        data += chunk
    for each in summary:
        if isinstance(each, mcap.records.Statistics):
            each.chunk_count = len(chunks)
            each.attachment_count = each.metadata_count = 0
    mcap.records.DataEnd(0).write(builder)
    return summarised(data + builder.end(), summary)


def _megabytes() -> Iterator[bytes]:
    return (MILLION_ZEROS for _ in range(BOMB))


@cache
def _bz2_bomb() -> bytes:
    return bz2.compress(bytes(10**8)) * (BOMB // 100)  # in parts, for it takes long to make


@cache
def _lz4_bomb() -> bytes:
    packer = lz4.frame.LZ4FrameCompressor()
    parts = [packer.begin(), *map(packer.compress, _megabytes()), packer.flush()]
    return b"".join(parts)


@cache
def _zstd_bomb() -> bytes:
    packer = zstandard.ZstdCompressor().compressobj()
    return b"".join(map(packer.compress, _megabytes())) + packer.flush()
