"""Writes bags in MCAP, each with the channels, attachments and metadata of another bag."""

from collections import Counter
from copy import deepcopy
from dataclasses import replace
from pathlib import Path
from typing import Any

from mcap.records import Attachment
from mcap.writer import CompressionType, Writer

from derain.bags.mcap_reader import McapConnection, McapReader
from derain.bags.ros2_metadata import NONE, Ros2Metadata

# The entry of a metadata record in which ROS 2 repeats the metadata.yaml.
ROS2_NOTE = "serialized_metadata"


class McapWriter:
    """Writes messages to a file of MCAP, or to a folder with one and its metadata.yaml.

    Channels keep their schemas and notes, and messages their numbers and times. Attachments and
    metadata are written last. What was compressed as a file or message by message is compressed in
    chunks, by zstd.

    Args:
        bag: The other bag, open.
        metadata: Its metadata.yaml; None for a file.
        path: Path of the written bag: a folder where there is a metadata.yaml.
    """

    def __init__(self, bag: McapReader, metadata: Ros2Metadata | None, path: Path) -> None:
        self.bag = bag
        self.metadata = metadata
        self.path = path
        if metadata is not None:
            path.mkdir()
            path = path / f"{path.name}.mcap"
        self._file = path.open("xb")
        chunks = (chunk.compression for each in bag.files for chunk in each.chunks)
        is_packed = metadata is not None and metadata.compression
        compression = "zstd" if is_packed else next(chunks, "")
        kind = CompressionType[compression.upper() or "NONE"]
        self._writer: Any = Writer(self._file, compression=kind)
        self._writer.start(bag.files[0].profile)
        self._schemas: dict[object, int] = {None: 0}
        self._channels: dict[McapConnection, int] = {}
        self._counts = Counter[str]()
        self._topics: dict[str, dict[str, Any]] = {}

    def connection(self, like: McapConnection, topic: str | None = None) -> McapConnection:
        """A connection of this bag; see :meth:`RosbagsWriter.connection`."""
        new = replace(like, topic=topic or like.topic)
        if new not in self._channels:
            if new.schema is not None and new.schema not in self._schemas:
                self._schemas[new.schema] = self._writer.register_schema(*new.schema)
            self._channels[new] = self._writer.register_channel(
                new.topic, new.encoding, self._schemas[new.schema], dict(new.notes)
            )
            if self.metadata is not None:
                self._topics[new.topic] = self.metadata.topic(like.topic) | {"name": new.topic}
        return new

    def write(self, connection: McapConnection, like: Any, data: bytes) -> None:
        """Writes a message; see :meth:`RosbagsWriter.write`."""
        self._writer.add_message(
            self._channels[connection], like.time, data, like.published, like.sequence
        )
        self._counts[connection.topic] += 1

    def close(self) -> None:
        """Completes the bag."""
        for record in self.bag.attachments_and_metadata():
            if isinstance(record, Attachment):
                times = record.create_time, record.log_time
                self._writer.add_attachment(*times, record.name, record.media_type, record.data)
            elif ROS2_NOTE not in record.metadata:
                self._writer.add_metadata(record.name, record.metadata)
        self._writer.finish()
        self._file.close()
        if self.metadata is not None:
            self._written_metadata(self.metadata).write(self.path)

    def abort(self) -> None:
        """Closes the bag, which stays incomplete."""
        self._file.close()

    def _written_metadata(self, old: Ros2Metadata) -> Ros2Metadata:
        """The metadata of this bag: that of the other, with what differs."""
        file = Path(self._file.name).name
        span = {
            "starting_time": {"nanoseconds_since_epoch": self.bag.start_time},
            "duration": {"nanoseconds": self.bag.duration},
        }
        count = {"message_count": self._counts.total()}
        content = old.content | {
            **span,
            **count,
            "compression_format": "",
            "compression_mode": NONE,
            "topics_with_message_count": [
                {"topic_metadata": topic, "message_count": self._counts[name]}
                for name, topic in self._topics.items()
            ],
            "relative_file_paths": [file],
            "files": [{"path": file, **deepcopy(span), **count}],
        }
        return replace(old, content=content, files=(file,), compression=NONE)
