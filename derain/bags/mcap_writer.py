"""Writes bags in MCAP, each with the settings, attachments and metadata of another bag."""

import os
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

import yaml
from mcap.records import Attachment, Metadata
from mcap.writer import CompressionType, Writer

from derain.bags.mcap_reader import McapConnection, McapReader
from derain.bags.ros2_metadata import (
    FILE,
    MESSAGE,
    NEWEST_VERSION,
    NONE,
    OLDER_VERSION,
    Ros2Metadata,
    small_yaml,
)
from derain.system.extras import ZSTANDARD

# The metadata record in which ROS 2 repeats the metadata.yaml, and the name of its entry.
ROS2_RECORD, ROS2_NOTE = "rosbag2", "serialized_metadata"

# Names of what ROS 2 notes of a channel.
QOS, TYPE_HASH = "offered_qos_profiles", "topic_type_hash"


class McapWriter:
    """Writes messages to a folder of ROS 2 with one file of MCAP.

    Channels keep their schemas and notes, and messages their numbers and times. Attachments,
    metadata and private records are written last.

    Args:
        bag: The other bag, open.
        metadata: Its metadata.yaml; None for a file.
        path: The folder, which is made.
    """

    def __init__(self, bag: McapReader, metadata: Ros2Metadata | None, path: Path) -> None:
        self.bag = bag
        self.metadata = metadata
        self._compression = NONE if metadata is None else metadata.compression
        self.path = path
        path.mkdir(parents=True)
        self._file = (path / f"{path.name}.mcap").open("xb")
        chunks = [chunk for file in bag.files for chunk in file.chunks]
        used = {chunk.compression for chunk in chunks}
        kinds = [kind for kind in CompressionType if kind.name.lower() in used]
        self._writer: Any = Writer(
            self._file,
            compression=kinds[0] if kinds else CompressionType.NONE,
            use_chunking=bool(chunks) or not bag.message_count,
        )
        self._writer.start(bag.files[0].records.profile)
        self._schemas: dict[object, int] = {None: 0}
        self._channels: dict[McapConnection, int] = {}
        self._counts: dict[McapConnection, int] = {}
        self._first, self._last = 2**63 - 1, 0

    def connection(self, like: McapConnection, topic: str | None = None) -> McapConnection:
        """A connection of this bag; see :meth:`RosbagsWriter.connection`."""
        new = replace(like, topic=topic or like.topic)
        if new not in self._channels:
            if new.schema is not None and new.schema not in self._schemas:
                self._schemas[new.schema] = self._writer.register_schema(*new.schema)
            self._channels[new] = self._writer.register_channel(
                new.topic, new.encoding, self._schemas[new.schema], dict(new.notes)
            )
            self._counts[new] = 0
        return new

    def write(self, connection: McapConnection, like: Any, data: bytes) -> None:
        """Writes a message; see :meth:`RosbagsWriter.write`."""
        if self._compression == MESSAGE:
            data = ZSTANDARD.load(self.path).compress(data)
        self._writer.add_message(
            self._channels[connection], like.time, data, like.published, like.sequence
        )
        self._counts[connection] += 1
        self._first, self._last = min(self._first, like.time), max(self._last, like.time)

    def close(self) -> None:
        """Completes the bag."""
        for record in self.bag.attachments_and_metadata():
            if isinstance(record, Attachment):
                times = record.create_time, record.log_time
                self._writer.add_attachment(*times, record.name, record.media_type, record.data)
            elif record.name != ROS2_RECORD:
                self._writer.add_metadata(record.name, record.metadata)
        metadata = self._metadata()
        text = yaml.safe_dump(metadata.content, sort_keys=False)
        self._writer.add_metadata(ROS2_RECORD, {ROS2_NOTE: text})
        for file in self.bag.files:
            self._file.writelines(file.records.private())  # the library writes none
        self._writer.finish()
        self._file.close()
        if self._compression == FILE:
            _pack(Path(self._file.name))
        metadata.write(self.path)

    def abort(self) -> None:
        """Closes the bag, which stays incomplete."""
        self._file.close()

    def _metadata(self) -> Ros2Metadata:
        """The metadata of the new bag: that of the other, with what differs."""
        old = self._old_metadata()
        topics: dict[str, dict[str, Any]] = {
            each["topic_metadata"]["name"]: each["topic_metadata"]
            for each in old.get("topics_with_message_count", ())
        }
        version = int(old.get("version", 0)) or self._version()
        span = {
            "starting_time": {"nanoseconds_since_epoch": self._first},
            "duration": {"nanoseconds": max(0, self._last - self._first)},
            "message_count": sum(self._counts.values()),
        }
        name = os.path.basename(self._file.name) + (".zstd" if self._compression == FILE else "")
        content = {
            "compression_format": "",
            "compression_mode": "",
            "custom_data": None,
            "ros_distro": "unknown",
            **old,
            "version": version,
            "storage_identifier": "mcap",
            **span,
            "topics_with_message_count": [
                {
                    "topic_metadata": _topic_metadata(connection, version, topics),
                    "message_count": number,
                }
                for connection, number in self._counts.items()
            ],
            "relative_file_paths": [name],
            "files": [{"path": name, **deepcopy(span)}],
        }
        return Ros2Metadata(content, version, "mcap", (name,), self._compression)

    def _old_metadata(self) -> dict[str, Any]:
        """The content of the other bag's metadata.yaml, or of its repetition in the file."""
        if self.metadata is not None:
            return deepcopy(self.metadata.content)
        for record in self.bag.attachments_and_metadata():
            if isinstance(record, Metadata) and record.name == ROS2_RECORD:
                return dict(_from_yaml(record.metadata.get(ROS2_NOTE, ""), dict))
        return {}

    def _version(self) -> int:
        """The version that writes quality of service as the channels do."""
        texts = (dict(each.notes).get(QOS, "") for each in self._channels)
        newest = any("keep_last" in text or "keep_all" in text for text in texts)
        return NEWEST_VERSION if newest else OLDER_VERSION


def _topic_metadata(
    connection: McapConnection, version: int, known: dict[str, dict[str, Any]]
) -> dict[str, Any]:
    """The entry of a topic in a metadata.yaml."""
    notes = dict(connection.notes)
    profiles: Any = notes.get(QOS, "")
    if version >= NEWEST_VERSION:
        profiles = _from_yaml(profiles, list)
    made: dict[str, Any] = {
        "name": connection.topic,
        "type": connection.msgtype,
        "serialization_format": connection.encoding,
        "offered_qos_profiles": profiles,
        "type_description_hash": notes.get(TYPE_HASH, ""),
    }
    return made | known.get(connection.topic, {})


def _from_yaml(note: str, kind: type) -> Any:
    """The value of a note in YAML; an empty one where it is damaged or of another kind."""
    try:
        value = small_yaml(note)
    except ValueError:
        return kind()
    return value if isinstance(value, kind) else kind()


def _pack(file: Path) -> None:
    """Replaces a file by a compressed one."""
    compressor = ZSTANDARD.load(file).ZstdCompressor()
    packed = file.with_name(f"{file.name}.zstd")
    with file.open("rb") as source, packed.open("xb") as target:
        compressor.copy_stream(source, target)
    file.unlink()
