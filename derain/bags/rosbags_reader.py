"""Opens bags of ROS 1 and SQLite with rosbags, with bounds on the sizes that it reads."""

import os
from collections import Counter
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from dataclasses import dataclass
from io import BytesIO
from pathlib import Path
from struct import Struct
from typing import Any, BinaryIO

from derain.bags.names import logs_of
from derain.bags.unpacking import MOST_UNPACKED, unpack
from derain.errors import InputError
from derain.files.reading import reading
from derain.system.extras import APSW, ROSBAGS

# Bytes at the beginning of a log of SQLite, which are 0 or missing where all of it is written.
# Source: SQLite, "Database File Format", section 3: the header of a rollback journal.
LOG_HEAD = 28

# The most topics of a bag, where each publisher of ROS 1 counts as one. The library's time grows
# with their square, and a metadata.yaml that lists many more is too large to be read.
MOST_TOPICS = 4096

# Tables of a database of ROS 2.
ROS2_TABLES = {"schema", "metadata", "topics", "message_definitions", "messages"}

# Records of ROS 1 begin with the size of their header and the header, then the size of their data.
# Source: the bag format 2.0 (http://wiki.ros.org/Bags/Format/2.0).
RECORD_SIZE = Struct("<I")
OP = b"\4\0\0\0op="
OP_MESSAGE, OP_BAG_HEADER, OP_INDEX, OP_CHUNK, OP_CHUNK_INFO, OP_CONNECTION = range(2, 8)


@contextmanager
def rosbags_reader(path: Path, is_ros1: bool) -> Iterator[Any]:
    """Lends a reader of the library, open.

    It does not unpack messages that are compressed one by one.

    Args:
        path: A file of ROS 1 or of SQLite, or a folder of ROS 2 with files of SQLite.
        is_ros1: True if it is a file of ROS 1.

    Raises:
        InputError: A database with messages that are still in a log beside it.
    """
    if is_ros1:
        reader = ROSBAGS.load(path, "rosbag1").Reader(path)
        reader.read_chunk_info = _each_chunk_once(reader.read_chunk_info)
        with reader:
            entries = Counter(e.chunk_pos for index in reader.indexes.values() for e in index)
            reader.chunks = {
                place: _bounded(chunk, entries[place]) for place, chunk in reader.chunks.items()
            }
            yield reader
        return
    reader = ROSBAGS.load(path, "rosbag2").Reader(path)
    with _checked_databases(path):
        reader.open()
    try:
        reader.storage.metadata = reader.storage.metadata._replace(compression_mode=None)
        yield reader
    finally:
        with suppress(Exception):  # where a query was given up halfway, it is "locked"
            reader.close()


def other_tables(reader: Any) -> list[str]:
    """Names of tables in the databases of a bag that are none of ROS 2.

    Args:
        reader: A reader of :func:`rosbags_reader`.
    """
    tables = "SELECT name FROM sqlite_schema WHERE type = 'table' AND name NOT LIKE 'sqlite_%'"
    found = {name for each in _databases(reader) for (name,) in each.dbconn.execute(tables)}
    return sorted(found - ROS2_TABLES)


def stored_messages(reader: Any) -> int:
    """Number of messages in the files of a bag, also of topics that it does not list.

    Args:
        reader: A reader of :func:`rosbags_reader`.

    Raises:
        ValueError: A bag of ROS 1 with chunks or messages that its index does not name.
    """
    if not hasattr(reader, "chunks"):
        return sum(database.metadata.message_count for database in _databases(reader))
    if reader.chunks.keys() != set(_chunk_places(reader.path)):
        raise ValueError("its index does not name all chunks")
    for chunk in reader.chunks.values():
        if not chunk.decompressor.messages:  # otherwise unpacked, and so checked, by its messages
            reader.bio.seek(chunk.datapos)
            chunk.decompressor(reader.bio.read(chunk.datasize))
    return sum(map(len, reader.indexes.values()))


def _databases(reader: Any) -> list[Any]:
    return list(getattr(reader.storage, "storages", [reader.storage]))


@dataclass(frozen=True)
class ChunkUnpacker:
    """Unpacks a chunk of ROS 1.

    Attributes:
        compression: Name of the compression.
        messages: Number of its messages in the index.
    """

    compression: str
    messages: int

    def __call__(self, data: bytes) -> bytes:
        """Unpacks its bytes.

        Raises:
            ValueError: They are damaged, too many, or other messages than the index has.
        """
        content = unpack(data, self.compression)
        found = sum(kind == OP_MESSAGE for _, kind in _records(BytesIO(content)))
        if found != self.messages:
            raise ValueError(f"its index has {self.messages:,} of {found:,} messages of a chunk")
        return content


def _records(file: BinaryIO) -> Iterator[tuple[int, int]]:
    """Place and kind of consecutive records of ROS 1."""
    while head := file.read(RECORD_SIZE.size):
        place = file.tell() - RECORD_SIZE.size
        (size,) = RECORD_SIZE.unpack(head)
        header = file.read(size)
        kind = header.partition(OP)[2][:1]
        if not kind:
            raise ValueError(f"a record without a kind at byte {place:,}")
        yield place, kind[0]
        (size,) = RECORD_SIZE.unpack(file.read(RECORD_SIZE.size))
        file.seek(size, os.SEEK_CUR)


def _chunk_places(path: Path) -> Iterator[int]:
    with path.open("rb") as file:
        file.readline()  # the version
        for place, kind in _records(file):
            if kind == OP_CHUNK:
                yield place
            elif kind not in (OP_BAG_HEADER, OP_INDEX, OP_CHUNK_INFO, OP_CONNECTION):
                raise ValueError(f"a record outside its chunks (op {kind}) is in no index")


def _each_chunk_once(read_chunk_info: Callable[[], Any]) -> Callable[[], Any]:
    """Wraps what reads the index of ROS 1, to refuse a chunk that is listed twice."""
    places: set[int] = set()

    def read() -> Any:
        found = read_chunk_info()
        if found.pos in places:
            raise ValueError("its index names a chunk more than once")
        places.add(found.pos)
        return found

    return read


def _bounded(chunk: Any, messages: int) -> Any:
    """The same chunk of ROS 1, unpacked by derain."""
    by_name = ROSBAGS.load("bags", "rosbag1.reader").decompressors
    names = {function: name for name, function in by_name.items()}
    return chunk._replace(decompressor=ChunkUnpacker(names[chunk.decompressor], messages))


@contextmanager
def _checked_databases(path: Path) -> Iterator[None]:
    """Bounds the databases that are opened in the block: the size of a value, and the topics.

    It refuses one with a log, which the library would not read.
    """
    apsw = APSW.load(path)

    def check(database: Any) -> None:
        _refuse_log(Path(database.filename))
        database.limit(apsw.SQLITE_LIMIT_LENGTH, MOST_UNPACKED)
        listed = "SELECT name FROM sqlite_schema WHERE name IN ('topics', 'message_definitions')"
        for (table,) in database.execute(listed).fetchall():
            rows = f"SELECT count(*) FROM (SELECT 1 FROM {table} LIMIT {MOST_TOPICS + 1})"
            if database.execute(rows).get > MOST_TOPICS:
                raise ValueError(f"it has more than {MOST_TOPICS:,} topics")

    apsw.connection_hooks.append(check)
    try:
        yield
    finally:
        apsw.connection_hooks.remove(check)


def _refuse_log(database: Path) -> None:
    for log in logs_of(database) if database.name else ():  # one in memory has no name
        with reading(log), log.open("rb") as file:
            if not any(file.read(LOG_HEAD)):
                continue
        raise InputError(
            database,
            f"{log.name} holds changes that are not in it yet",
            "End the recording. After a crash, copy both files and have SQLite write the log into "
            f"the copy: sqlite3 {database.name} 'PRAGMA wal_checkpoint(TRUNCATE)'.",
        )
