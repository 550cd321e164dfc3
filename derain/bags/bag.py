"""A bag: which topics it has, and its messages one after the other.

The libraries that read bags raise many exceptions, and check little of what they read. Here each
of these becomes one InputError.
"""

import os
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from derain.bags.cloud_message import CDR, ROS1
from derain.bags.names import ROS1_SUFFIX
from derain.bags.ros2_metadata import FILE, MESSAGE, Ros2Metadata
from derain.bags.rosbags_reader import MOST_TOPICS, rosbags_reader, stored_messages
from derain.bags.topics import Topic, cloud_topic
from derain.bags.unpacking import unpack, unpacked_bag
from derain.errors import InputError, reason_of
from derain.system.extras import MCAP


class Message(NamedTuple):
    """One message of a bag.

    Attributes:
        connection: The reader's connection, which describes its topic and publisher.
        time: Time of recording, nanoseconds.
        data: Its bytes.
        published: Time of publication, nanoseconds; 0 in storages other than MCAP.
        sequence: Its number, as the publisher counts; 0 in storages other than MCAP.
    """

    connection: Any
    time: int
    data: bytes
    published: int = 0
    sequence: int = 0


class Bag:
    """A recording of ROS 1 or ROS 2, in any storage.

    Args:
        path: A file .bag, .mcap or .db3, or a folder with a metadata.yaml.
    """

    def __init__(self, path: Path) -> None:
        self.path = path
        self._unpacked: Path | None = None  # another process gets it by pickling

    @property
    def is_ros1(self) -> bool:
        """True if ROS 1 recorded it."""
        return self.path.suffix.lower() == ROS1_SUFFIX and not os.path.isdir(self.path)

    @cached_property
    def metadata(self) -> Ros2Metadata | None:
        """The metadata.yaml of a folder; None of a file.

        Raises:
            InputError: It is damaged, or of an unknown version or storage.
        """
        with self.reading():
            return Ros2Metadata.read(self.path) if os.path.isdir(self.path) else None

    @cached_property
    def storage(self) -> str:
        """Its storage: ``ros1``, ``mcap`` or ``sqlite3``.

        Raises:
            InputError: As for :attr:`metadata`.
        """
        if self.metadata is not None:
            return self.metadata.storage
        if self.is_ros1:
            return "ros1"
        return "mcap" if self.path.suffix.lower() == ".mcap" else "sqlite3"

    @cached_property
    def topics(self) -> tuple[Topic, ...]:
        """Its topics, by name.

        Raises:
            InputError: A bag that cannot be read, or has names and numbers of messages that no
                recording has.
        """
        encoding = ROS1 if self.is_ros1 else CDR
        found: dict[tuple[str, str], Topic] = {}
        with self.opened() as reader:
            for connection in reader.connections:
                name = (str(connection.topic), str(connection.msgtype))
                if "\0" in name[0]:
                    raise ValueError(f"the topic {name[0]} has a NUL in its name")
                before = found[name].messages if name in found else 0
                messages = before + max(int(connection.msgcount), 0)
                written = str(connection.encoding) if self.storage == "mcap" else encoding
                found[name] = Topic(*name, messages, written)
            messages = sum(topic.messages for topic in found.values())
            size = sum((self.path / name).stat().st_size for name in _names_of_files(self.metadata))
            if messages > size:
                raise ValueError(f"{messages:,} messages are stated in {size:,} bytes")
        return tuple(topic for _, topic in sorted(found.items()))

    def cloud_topic(self, name: str = "") -> Topic:
        """The topic of point clouds of a name, or the only one.

        Args:
            name: Its name; empty where the bag has only one of them.

        Raises:
            InputError: No such topic, one of another type, none at all, or several.
        """
        return cloud_topic(self.path, self.topics, name)

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """Lends an open reader of the bag: that of rosbags, or derain's of MCAP.

        Raises:
            InputError: A library is not installed; or the bag cannot be read, also in the block.
        """
        with self.reading():
            metadata = self.metadata
            path = self.path
            if metadata is not None and metadata.compression == FILE:
                if self._unpacked is None or not os.path.isdir(self._unpacked):
                    self._unpacked = unpacked_bag(self.path, metadata)
                path, metadata = self._unpacked, metadata.unpacked()
            with self._reader(path, metadata) as reader:
                if len(reader.connections) > MOST_TOPICS:
                    raise ValueError(f"it has more than {MOST_TOPICS:,} topics")
                yield reader

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Turns the errors of reading the bag into an InputError.

        Raises:
            InputError: An exception of the block.
        """
        try:
            yield
        except (InputError, BrokenPipeError):
            raise
        except Exception as error:  # the libraries check little of what they read
            reason = reason_of(error).rstrip(".")
            raise InputError(
                self.path,
                f"cannot be read as a bag ({reason})",
                "Decrypt it by rosbag decrypt."
                if "encrypt" in reason
                else "It is damaged, cut off, encrypted or of another kind. A bag that was cut off "
                f"may be repaired by {self._rescuer}",
            ) from error

    def messages(self, topic: Topic | None = None, start: int | None = None) -> Iterator[Message]:
        """Its messages in the order of time, read one at a time.

        Args:
            topic: The topic; None means all of them.
            start: The first time of interest, nanoseconds; None for the beginning.

        Raises:
            InputError: A bag that cannot be read.
        """
        with self.opened() as reader:
            yield from self.messages_of(reader, topic, start)

    def messages_of(
        self, reader: Any, topic: Topic | None = None, start: int | None = None
    ) -> Iterator[Message]:
        """As :meth:`messages`, by a reader that is open already.

        Args:
            reader: The reader that :meth:`opened` lends; a new call ends the one before.
            topic: As for :meth:`messages`.
            start: As for :meth:`messages`.

        Raises:
            InputError: As for :meth:`messages`; or no topic and no start is given, and the bag has
                messages that its index or its topics lack.
        """
        with self.reading():
            chosen = [c for c in reader.connections if topic is None or topic.has(c)]
            if not chosen:
                return
            packed = self.metadata is not None and self.metadata.compression == MESSAGE
            compression = "zstd" if packed else ""
            stored = None
            if topic is None and start is None:
                is_mcap = self.storage == "mcap"
                stored = reader.message_count if is_mcap else stored_messages(reader)
            number = 0
            for connection, time, data, *more in reader.messages(chosen, start=start):
                number += 1
                yield Message(connection, time, unpack(bytes(data), compression), *more)
            if stored is not None and number != stored:
                raise ValueError(f"its topics have {number:,} of {stored:,} messages")

    def wrong_index(self, reason: str) -> InputError:
        """The error of a bag whose index has more or fewer messages than the bag."""
        return InputError(
            self.path, reason, "Rebuild its index by `ros2 bag reindex` or `rosbag reindex`."
        )

    def too_few_clouds(self, topic: Topic) -> InputError:
        """The error of a bag with fewer messages of a topic than its index has."""
        return self.wrong_index(
            f"has fewer messages of {topic.name} than the {topic.messages:,} of its index"
        )

    def _reader(self, path: Path, metadata: Ros2Metadata | None) -> Any:
        if self.storage != "mcap":
            return rosbags_reader(path, self.is_ros1)
        MCAP.load(self.path)
        from derain.bags.mcap_reader import mcap_reader

        return mcap_reader([path / name for name in _names_of_files(metadata)])

    @property
    def _rescuer(self) -> str:
        if self.is_ros1:
            return "rosbag reindex."
        names = os.listdir(self.path) if os.path.isdir(self.path) else [self.path.name]
        is_mcap = any(name.lower().endswith(".mcap") for name in names)
        return "mcap recover." if is_mcap else "sqlite3's .recover."


def _names_of_files(metadata: Ros2Metadata | None) -> Sequence[str]:
    """Names of the files of a bag, below its path; one that is a file has the empty name."""
    return ("",) if metadata is None else metadata.files
