"""Writes bags of ROS 1 and SQLite by the library, each with the settings of another bag."""

from pathlib import Path
from typing import Any

import yaml

from derain.bags.bag import Bag, Message
from derain.bags.ros2_metadata import NEWEST_VERSION, OLDER_VERSION
from derain.system.extras import LZ4, ROSBAGS


class RosbagsWriter:
    """Writes messages to a bag of ROS 1 or SQLite that is like another.

    Connections keep definition, hash, quality of service, caller and latching. Two publishers that
    differ in none of these become one.

    Args:
        bag: The other bag.
        reader: The library's reader of it, open.
        path: Path of the written bag: a file of ROS 1, a folder of ROS 2.
    """

    def __init__(self, bag: Bag, reader: Any, path: Path) -> None:
        self.path = path
        self._is_ros1 = bag.is_ros1
        self._writer = _ros1(reader, self.path) if bag.is_ros1 else _ros2(bag, reader, self.path)
        self._writer.open()
        self._connections: dict[Any, Any] = {}

    def connection(self, like: Any, topic: str | None = None) -> Any:
        """The connection of this bag that corresponds to one of the other bag.

        Args:
            like: The other bag's connection.
            topic: Name of the topic; None for the same one.
        """
        new = like._replace(
            id=0, topic=topic or like.topic, msgcount=0, owner=None, ext=repr(like.ext)
        )
        if new not in self._connections:
            declare = self._declare_ros1 if self._is_ros1 else self._declare_ros2
            self._connections[new] = declare(like, new.topic)
        return self._connections[new]

    def write(self, connection: Any, like: Message, data: bytes) -> None:
        """Writes a message.

        Args:
            connection: A result of :meth:`connection`.
            like: The message of the other bag whose time it gets.
            data: Its bytes.
        """
        self._writer.write(connection, like.time, data)

    def close(self) -> None:
        """Completes the bag."""
        self._writer.close()

    def abort(self) -> None:
        """Closes the bag, which stays incomplete."""
        self._writer.abort()

    def _declare_ros1(self, like: Any, topic: str) -> Any:
        return self._writer.add_connection(
            topic,
            like.msgtype,
            msgdef=like.msgdef.data,
            md5sum=like.digest,
            callerid=like.ext.callerid,
            latching=like.ext.latching,
        )

    def _declare_ros2(self, like: Any, topic: str) -> Any:
        """Declares a connection without a change.

        The library's `add_connection` requires definition and hash, which bags of older ROS 2 lack,
        and guesses the language of the definition.
        """
        writer = self._writer
        new = like._replace(id=len(writer.connections) + 1, topic=topic, msgcount=0, owner=writer)
        metadata = ROSBAGS.load(self.path, "rosbag2.metadata")
        newer = writer.version >= NEWEST_VERSION
        profiles = (metadata.dump_qos_v9 if newer else metadata.dump_qos_v8)(
            new.ext.offered_qos_profiles
        )
        text = profiles if isinstance(profiles, str) else yaml.safe_dump(profiles).strip()
        if new.msgtype not in writer.added_types and new.msgdef.data:
            writer.storage.add_msgtype(new)
            writer.added_types.add(new.msgtype)
        writer.storage.add_connection(new, text)
        writer.connections.append(new)
        writer.counts[new.id] = 0
        return new


def _ros1(reader: Any, path: Path) -> Any:
    """A writer of ROS 1 that compresses as the other bag does."""
    library = ROSBAGS.load(path, "rosbag1")
    used = {chunk.decompressor.keywords["compression"] for chunk in reader.chunks.values()}
    writer = library.Writer(path)
    for format_ in library.Writer.CompressionFormat:
        if format_.name.lower() in used:
            writer.set_compression(format_)
    if writer.compression_format == "lz4":
        writer.compressor = _lz4_of_ros1
    return writer


def _lz4_of_ros1(data: bytes) -> bytes:
    """Compresses a chunk in the way that ROS 1 can read.

    Source: roslz4, which refuses linked blocks and a size of the content, and requires a checksum.
    """
    packed: bytes = LZ4.load("bags", "frame").compress(
        data, block_linked=False, content_checksum=True, store_size=False
    )
    return packed


def _ros2(bag: Bag, reader: Any, path: Path) -> Any:
    """A writer of ROS 2 with the compression and notes of the other bag."""
    library = ROSBAGS.load(path, "rosbag2")
    newer = bag.metadata is not None and bag.metadata.version >= NEWEST_VERSION
    writer = library.Writer(
        path,
        version=NEWEST_VERSION if newer else OLDER_VERSION,
        storage_plugin=library.StoragePlugin.SQLITE3,
    )
    if bag.metadata is not None and bag.metadata.compression:
        mode = library.CompressionMode[bag.metadata.compression.upper()]
        writer.set_compression(mode, library.CompressionFormat.ZSTD)
    for key, value in (reader.storage.metadata.custom or {}).items():
        writer.set_custom_data(str(key), str(value))
    return writer
