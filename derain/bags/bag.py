"""A bag: which topics it has, and its messages one after the other.

The libraries that read bags raise many exceptions, and check little of what they read. Here each
of these becomes one InputError.
"""

import os
from collections import Counter
from collections.abc import Iterator
from contextlib import AbstractContextManager, contextmanager
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from derain.bags.cloud_message import CDR, ROS1
from derain.bags.names import MCAP_SUFFIX, ROS1_SUFFIX, files_of
from derain.bags.ros2_metadata import FILE, MESSAGE, Ros2Metadata
from derain.bags.rosbags_reader import MOST_TOPICS, rosbags_reader, stored_messages
from derain.bags.topics import Topic, cloud_topic
from derain.bags.unpacking import unpack, unpacked_bag
from derain.errors import InputError, reason_of
from derain.files.reading import file_size
from derain.system.extras import MCAP

# Suffix of a file → its storage; of any other, SQLite.
STORAGES = {ROS1_SUFFIX: "ros1", MCAP_SUFFIX: "mcap"}


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
        return STORAGES.get(self.path.suffix.lower(), "sqlite3")

    @property
    def is_ros1(self) -> bool:
        """True if it is a file of ROS 1."""
        return self.storage == "ros1"

    @cached_property
    def topics(self) -> tuple[Topic, ...]:
        """Its topics, by name.

        Raises:
            InputError: A bag that cannot be read, or has names and numbers of messages that no
                recording has.
        """
        usual = ROS1 if self.is_ros1 else CDR
        numbers = Counter[tuple[str, str, str]]()
        with self.opened() as reader:
            for connection in reader.connections:
                name, encoding = str(connection.topic), usual
                if "\0" in name:
                    raise ValueError(f"the topic {name} has a NUL in its name")
                if self.storage == "mcap":
                    encoding = str(connection.encoding)
                messages = max(int(connection.msgcount), 0)
                numbers[name, str(connection.msgtype), encoding] += messages
            size = sum(map(file_size, files_of(self.path)))
            if numbers.total() > size:
                raise ValueError(f"{numbers.total():,} messages are stated in {size:,} bytes")
        return tuple(
            Topic(name, kind, number, encoding)
            for (name, kind, encoding), number in sorted(numbers.items())
        )

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
            path, metadata = self.path, self.metadata
            if metadata is not None and metadata.compression == FILE:
                if self._unpacked is None or not os.path.isdir(self._unpacked):
                    self._unpacked = unpacked_bag(path, metadata)
                path, metadata = self._unpacked, metadata.unpacked()
            if self.storage == "mcap":
                MCAP.load(self.path)
                from derain.bags.mcap_reader import mcap_reader

                names = [""] if metadata is None else metadata.files
                lent = mcap_reader([path / name for name in names])
            else:
                lent = rosbags_reader(path, self.is_ros1)
            with lent as reader:
                if len(reader.connections) > MOST_TOPICS:
                    raise ValueError(f"it has more than {MOST_TOPICS:,} topics")
                yield reader

    def reading(self) -> AbstractContextManager[None]:
        """Turns the errors of reading the bag into an InputError.

        Raises:
            InputError: An exception of the block.
        """
        return library_errors(
            self.path,
            "cannot be read as a bag",
            "It is damaged, cut off, encrypted or of another kind. Try `rosbag reindex` or "
            "`decrypt`, `mcap recover`, or SQLite's .recover.",
        )

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

    def wrong_index(self, topic: Topic) -> InputError:
        """The error of a bag with more or fewer messages of a topic than its index has."""
        return InputError(
            self.path,
            f"has other messages of {topic.name} than the {topic.messages:,} of its index",
            "Rebuild its index by `ros2 bag reindex` or `rosbag reindex`.",
        )


@contextmanager
def library_errors(bag: Path, what: str, remedy: str) -> Iterator[None]:
    """Turns any error of a block into an InputError: the libraries check little of what they read.

    Args:
        bag: Path of the bag.
        what: What failed.
        remedy: What to do.

    Raises:
        InputError: An exception of the block.
    """
    try:
        yield
    except (InputError, BrokenPipeError):
        raise
    except Exception as error:
        raise InputError(bag, f"{what} ({reason_of(error).rstrip('.')})", remedy) from error
