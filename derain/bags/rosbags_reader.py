"""Opens bags of ROS 1 and SQLite with rosbags, with bounds on the sizes that it reads."""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import partial
from pathlib import Path
from typing import Any

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
            reader.chunks = {place: _bounded(chunk) for place, chunk in reader.chunks.items()}
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


def stored_messages(reader: Any) -> int:
    """Number of messages in the files of a bag, also of topics that it does not list.

    Args:
        reader: A reader of :func:`rosbags_reader`.
    """
    if hasattr(reader, "chunk_infos"):
        return sum(sum(chunk.connection_counts.values()) for chunk in reader.chunk_infos)
    databases = getattr(reader.storage, "storages", [reader.storage])
    return sum(database.metadata.message_count for database in databases)


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


def _bounded(chunk: Any) -> Any:
    """The same chunk of ROS 1, unpacked by derain."""
    by_name = ROSBAGS.load("bags", "rosbag1.reader").decompressors
    names = {function: name for name, function in by_name.items()}
    unpacker = partial(unpack, compression=names[chunk.decompressor])
    return chunk._replace(decompressor=unpacker)


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
