"""Opens bags of ROS 1 and SQLite by the library, which then unpacks no more than a bag needs."""

from collections.abc import Iterator
from contextlib import contextmanager
from functools import partial
from pathlib import Path
from typing import Any

from derain.bags.unpacking import MOST_UNPACKED, unpack
from derain.system.extras import APSW, ROSBAGS


@contextmanager
def rosbags_reader(path: Path, is_ros1: bool) -> Iterator[Any]:
    """Lends a reader of the library, open.

    Where messages are compressed one by one, it gives them as they are.

    Args:
        path: A file of ROS 1, a file of SQLite, or a folder of ROS 2 with those.
        is_ros1: Whether it is ROS 1's.
    """
    if is_ros1:
        with ROSBAGS.load(path, "rosbag1").Reader(path) as reader:
            reader.chunks = {place: _bounded(chunk) for place, chunk in reader.chunks.items()}
            yield reader
        return
    reader = ROSBAGS.load(path, "rosbag2").Reader(path)
    with _bounded_databases(path):
        reader.open()
    try:
        reader.storage.metadata = reader.storage.metadata._replace(compression_mode=None)
        yield reader
    finally:
        reader.close()


def compressions_of(reader: Any) -> set[str]:
    """How the chunks of a bag of ROS 1 are compressed.

    Args:
        reader: What :func:`rosbags_reader` lends.
    """
    return {chunk.decompressor.keywords["compression"] for chunk in reader.chunks.values()}


def _bounded(chunk: Any) -> Any:
    """A chunk of ROS 1 that is unpacked by derain."""
    by_name = ROSBAGS.load("bags", "rosbag1.reader").decompressors
    names = {function: name for name, function in by_name.items()}
    unpacking = partial(unpack, compression=names[chunk.decompressor])
    return chunk._replace(decompressor=unpacking)


@contextmanager
def _bounded_databases(path: Path) -> Iterator[None]:
    """Has SQLite refuse values that are larger than any message, in what is opened meanwhile."""
    apsw = APSW.load(path)

    def bound(database: Any) -> None:
        database.limit(apsw.SQLITE_LIMIT_LENGTH, MOST_UNPACKED)

    apsw.connection_hooks.append(bound)
    try:
        yield
    finally:
        apsw.connection_hooks.remove(bound)
