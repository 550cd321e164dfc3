"""Writes a bag that is like another: its storage, its compression, and its topics as they were."""

import os
from pathlib import Path
from typing import Any

import yaml

from derain.bags.bag import Bag
from derain.bags.names import BAG_METADATA, stem
from derain.files.reading import reading
from derain.system.extras import ROSBAGS

# Versions of metadata.yaml that the library writes. The newer one spells quality of service in
# words, which readers older than it do not know.
NEWER_VERSION, OLDER_VERSION = 9, 8


class BagWriter:
    """Writes messages to a bag like another.

    Connections keep definition, hash, quality of service, caller and latching. Two publishers that
    differ in nothing that a bag tells become one.

    Args:
        bag: The other bag.
        reader: The library's reader of it, open.
        folder: Where the bag is written, named as the other: a file of ROS 1, a folder of ROS 2.
    """

    def __init__(self, bag: Bag, reader: Any, folder: Path) -> None:
        self.path = folder / written_name(bag)
        self._is_ros1 = bag.is_ros1
        self._writer = _ros1(reader, self.path) if bag.is_ros1 else _ros2(bag, reader, self.path)
        self._writer.open()
        self._connections: dict[Any, Any] = {}

    def connection(self, like: Any, topic: str | None = None) -> Any:
        """What messages are written to that come from a connection of the other bag.

        Args:
            like: The other bag's connection.
            topic: Name of another topic that is otherwise the same; None for the connection's own.
        """
        new = like._replace(
            id=0, topic=topic or like.topic, msgcount=0, owner=None, ext=repr(like.ext)
        )
        if new not in self._connections:
            declare = self._declare_ros1 if self._is_ros1 else self._declare_ros2
            self._connections[new] = declare(like, new.topic)
        return self._connections[new]

    def write(self, connection: Any, time: int, data: bytes) -> None:
        """Writes a message.

        Args:
            connection: What :meth:`connection` gave.
            time: When it was recorded, nanoseconds.
            data: Its bytes.
        """
        self._writer.write(connection, time, data)

    def close(self) -> None:
        """Ends the bag, which is whole then."""
        self._writer.close()

    def abort(self) -> None:
        """Lets go of the bag, which is not whole."""
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
        """Declares a connection as it is.

        The library's own way asks for definition and hash, which bags of older ROS 2 lack, and
        guesses the language of the definition.
        """
        writer = self._writer
        new = like._replace(id=len(writer.connections) + 1, topic=topic, msgcount=0, owner=writer)
        metadata = ROSBAGS.load(self.path, "rosbag2.metadata")
        newer = writer.version >= NEWER_VERSION
        profiles = (metadata.dump_qos_v9 if newer else metadata.dump_qos_v8)(
            new.ext.offered_qos_profiles
        )
        text = profiles if isinstance(profiles, str) else yaml.safe_dump(profiles).strip()
        is_mcap = writer.storage_plugin.name == "MCAP"  # whose channels cannot be without
        if new.msgtype not in writer.added_types and (new.msgdef.data or is_mcap):
            writer.storage.add_msgtype(new)
            writer.added_types.add(new.msgtype)
        writer.storage.add_connection(new, text)
        writer.connections.append(new)
        writer.counts[new.id] = 0
        return new


def written_name(bag: Bag) -> str:
    """What a bag that is written like another is called: of ROS 1 a file, of ROS 2 a folder."""
    return bag.path.name if bag.is_ros1 else stem(bag.path)


def _ros1(reader: Any, path: Path) -> Any:
    """A writer of ROS 1 that compresses as the other bag does."""
    library = ROSBAGS.load(path, "rosbag1")
    by_name = ROSBAGS.load(path, "rosbag1.reader").decompressors
    names = {function: name for name, function in by_name.items()}
    used = {names.get(chunk.decompressor, "none") for chunk in reader.chunks.values()}
    writer = library.Writer(path)
    for format_ in library.Writer.CompressionFormat:
        if format_.name.lower() in used:
            writer.set_compression(format_)
    return writer


def _ros2(bag: Bag, reader: Any, path: Path) -> Any:
    """A writer of ROS 2 with the storage, compression and notes of the other bag."""
    library = ROSBAGS.load(path, "rosbag2")
    newer = _version(bag) >= NEWER_VERSION
    mcap = storage_of(bag, reader) == "mcap"
    writer = library.Writer(
        path,
        version=NEWER_VERSION if newer else OLDER_VERSION,
        storage_plugin=library.StoragePlugin.MCAP if mcap else library.StoragePlugin.SQLITE3,
    )
    mode = (reader.compression_mode or "").upper()
    if not mode and any(chunk.compression for file in _files(reader) for chunk in _chunks(file)):
        mode = "STORAGE"
    if mode:
        writer.set_compression(library.CompressionMode[mode], library.CompressionFormat.ZSTD)
    for key, value in (reader.storage.metadata.custom or {}).items():
        writer.set_custom_data(str(key), str(value))
    return writer


def storage_of(bag: Bag, reader: Any) -> str:
    """How a bag is stored: ``ros1``, ``mcap`` or ``sqlite3``.

    Args:
        bag: The bag.
        reader: The library's reader of it, open.
    """
    if bag.is_ros1:
        return "ros1"
    return "mcap" if any(hasattr(file, "chunks") for file in _files(reader)) else "sqlite3"


def _files(reader: Any) -> list[Any]:
    """The readers of a bag's files: a folder may have several."""
    return list(getattr(reader.storage, "storages", None) or [reader.storage])


def _chunks(file: Any) -> list[Any]:
    return getattr(file, "chunks", [])


def _version(bag: Bag) -> int:
    """Version of a folder's metadata.yaml; 0 of a file without one."""
    path = bag.path / BAG_METADATA
    if not os.path.isfile(path):
        return 0
    with reading(path, yaml.YAMLError, UnicodeDecodeError):
        content = yaml.safe_load(path.read_text("utf-8"))
    return int(content["rosbag2_bagfile_information"]["version"])
