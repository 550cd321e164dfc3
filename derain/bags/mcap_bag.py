"""A bag in MCAP, read as the library reads the other storages: topics, and messages in time."""

from collections.abc import Collection, Iterator
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, NamedTuple, Self

from derain.bags.mcap_file import McapFile
from derain.bags.ros2_metadata import MESSAGE, Ros2Metadata
from derain.bags.unpacking import unpack
from derain.errors import InputError, reason_of


@dataclass(frozen=True)
class McapConnection:
    """A topic as one publisher has it; equal where a file says the same of them.

    Attributes:
        topic: Name of the topic.
        msgtype: Type of its messages, such as ``sensor_msgs/msg/PointCloud2``.
        msgcount: How many messages there are, over all files.
        encoding: How they are written, such as ``cdr``.
        notes: What else the channel says, such as quality of service; names and values.
        schema: Name, encoding and content of what defines the type; None where nothing does.
    """

    topic: str
    msgtype: str
    msgcount: int
    encoding: str
    notes: tuple[tuple[str, str], ...]
    schema: tuple[str, str, bytes] | None


class Recorded(NamedTuple):
    """One message, with what the other storages do not have after the rest.

    Attributes:
        connection: Its topic.
        time: When it was recorded, nanoseconds.
        data: Its bytes.
        published: When it was published, nanoseconds.
        sequence: Its number, as the publisher counts.
    """

    connection: McapConnection
    time: int
    data: bytes
    published: int
    sequence: int


class McapBag:
    """A file of MCAP, or a folder of ROS 2 with such files.

    Args:
        path: The file or folder.
        metadata: What the folder's metadata.yaml says; None for a file.
    """

    def __init__(self, path: Path, metadata: Ros2Metadata | None = None) -> None:
        self.path = path
        self.metadata = metadata
        self._files: list[McapFile] = []

    @property
    def files(self) -> list[McapFile]:
        """Its files, open, in the order of time."""
        return self._files

    @property
    def connections(self) -> list[McapConnection]:
        """Its topics, as publishers have them, in the order in which they come."""
        counts: dict[McapConnection, int] = {}
        for file in self._files:
            for number, connection in _connections(file).items():
                counts[connection] = counts.get(connection, 0) + file.counts[number]
        return [replace(each, msgcount=count) for each, count in counts.items()]

    @property
    def message_count(self) -> int:
        """Number of messages."""
        return sum(file.counts.total() for file in self._files)

    @property
    def start_time(self) -> int:
        """When the first message was recorded, nanoseconds; 0 where there is none."""
        return min((file.start for file in self._files if file.counts.total()), default=0)

    @property
    def duration(self) -> int:
        """Nanoseconds from the first to the last message."""
        last = max((file.end for file in self._files if file.counts.total()), default=0)
        return last - self.start_time

    def messages(
        self, connections: Collection[McapConnection], start: int | None = None
    ) -> Iterator[Recorded]:
        """Messages in the order of time within a file, and file after file.

        Args:
            connections: Those of interest.
            start: The first time of interest, nanoseconds; None for the beginning.

        Raises:
            ValueError: A damaged file.
        """
        wanted = {replace(each, msgcount=0): each for each in connections}
        packed = self.metadata is not None and self.metadata.compression == MESSAGE
        for file in self._files:
            of_file = _connections(file)
            channels = {n: wanted[each] for n, each in of_file.items() if each in wanted}
            for message in file.messages(channels, start):
                data = unpack(message.data, "zstd") if packed else message.data
                yield Recorded(
                    channels[message.channel],
                    message.time,
                    data,
                    message.published,
                    message.sequence,
                )

    def stored_messages(self) -> int:
        """Number of messages, once nothing but them and what describes them is in the files.

        Raises:
            ValueError: As for McapFile.check_whole.
        """
        for file in self._files:
            file.check_whole()
        return self.message_count

    def private_records(self) -> Iterator[bytes]:
        """Records of kinds that MCAP leaves to applications, byte for byte."""
        for file in self._files:
            yield from file.records.private()

    def attachments_and_metadata(self) -> Iterator[tuple[int, Any]]:
        """Kind and content of every record that is neither a message nor about messages.

        Raises:
            InputError: One is damaged.
        """
        try:
            for file in self._files:
                yield from file.attachments_and_metadata()
        except Exception as error:
            raise InputError(
                self.path,
                f"its attachments and metadata cannot be read ({reason_of(error)})",
                "Have it repaired by mcap recover.",
            ) from error

    def __enter__(self) -> Self:
        names = self.metadata.files if self.metadata is not None else ("",)
        with ExitStack() as stack:
            for name in names:
                self._files.append(McapFile(self.path / name))
                stack.callback(self._files[-1].close)
            self._stack = stack.pop_all()
        return self

    def __exit__(self, *_: object) -> None:
        self._stack.close()


def _connections(file: McapFile) -> dict[int, McapConnection]:
    """The channels of a file by their numbers."""
    found = {}
    for number, channel in file.channels.items():
        schema = file.schemas.get(channel.schema_id)
        if schema is None and channel.schema_id:
            raise ValueError(f"{channel.topic} has a type that is defined nowhere")
        definition = None if schema is None else (schema.name, schema.encoding, bytes(schema.data))
        found[number] = McapConnection(
            channel.topic,
            _long_name("" if schema is None else schema.name),
            0,
            channel.message_encoding,
            tuple(channel.metadata.items()),
            definition,
        )
    return found


def _long_name(type_: str) -> str:
    """The name of a type as ROS 2 has it."""
    package, _, name = type_.rpartition("/")
    return f"{package}/msg/{name}" if package and "/" not in package else type_
