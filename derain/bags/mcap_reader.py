"""Reads bags in MCAP, with the interface of the library that reads the other storages."""

from collections.abc import Collection, Iterator, Sequence
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Self

from mcap.records import Attachment, Metadata

from derain.bags.mcap_file import McapFile
from derain.errors import InputError, reason_of


@dataclass(frozen=True)
class McapConnection:
    """A topic of one publisher; equal for publishers that a file describes alike.

    Attributes:
        topic: Name of the topic.
        msgtype: Type of its messages, such as ``sensor_msgs/msg/PointCloud2``.
        msgcount: How many messages there are, over all files.
        encoding: How they are written, such as ``cdr``.
        notes: Names and values of the channel's metadata, such as quality of service.
        schema: Name, encoding and content of the definition of the type; None without one.
    """

    topic: str
    msgtype: str
    msgcount: int
    encoding: str
    notes: tuple[tuple[str, str], ...]
    schema: tuple[str, str, bytes] | None


class McapReader:
    """The files of a bag in MCAP, open inside a ``with`` block.

    Args:
        path: The bag, for errors.
        files: Its files, in the order of time.

    Attributes:
        files: The same, open.
    """

    def __init__(self, path: Path, files: Sequence[Path]) -> None:
        self.path = path
        self.files: list[McapFile] = []
        self._paths = files

    @property
    def connections(self) -> list[McapConnection]:
        """Its connections, in the order of the files."""
        counts: dict[McapConnection, int] = {}
        for file in self.files:
            for number, connection in _connections(file).items():
                counts[connection] = counts.get(connection, 0) + file.counts[number]
        return [replace(each, msgcount=count) for each, count in counts.items()]

    @property
    def message_count(self) -> int:
        """Number of messages."""
        return sum(file.counts.total() for file in self.files)

    @property
    def start_time(self) -> int:
        """When the first message was recorded, nanoseconds; 0 where there is none."""
        return min((file.start for file in self.files if file.counts.total()), default=0)

    @property
    def duration(self) -> int:
        """Nanoseconds from the first to the last message."""
        last = max((file.end for file in self.files if file.counts.total()), default=0)
        return last - self.start_time

    def messages(
        self, connections: Collection[McapConnection], start: int | None = None
    ) -> Iterator[tuple[McapConnection, int, bytes, int, int]]:
        """Messages in the order of time within a file, and file after file.

        Args:
            connections: Those of interest.
            start: The first time of interest, nanoseconds; None for the beginning.

        Yields:
            Connection, time of recording in nanoseconds, bytes, time of publication in nanoseconds,
            and number as the publisher counts.

        Raises:
            ValueError: A damaged file.
        """
        wanted = {replace(each, msgcount=0): each for each in connections}
        for file in self.files:
            of_file = _connections(file)
            channels = {n: wanted[each] for n, each in of_file.items() if each in wanted}
            for found in file.messages(channels, start):
                connection = channels[found.channel_id]
                yield connection, found.log_time, found.data, found.publish_time, found.sequence

    def stored_messages(self) -> int:
        """Number of messages in the files, after a check that each of them can be read.

        Raises:
            ValueError: As for McapFile.check_whole.
        """
        for file in self.files:
            file.check_whole()
        return self.message_count

    def private_records(self) -> Iterator[bytes]:
        """Records of kinds that MCAP leaves to applications, byte for byte."""
        for file in self.files:
            yield from file.records.private()

    def attachments_and_metadata(self) -> Iterator[Attachment | Metadata]:
        """Every record that is neither a message nor about messages.

        Raises:
            InputError: One is damaged.
        """
        try:
            for file in self.files:
                yield from file.attachments_and_metadata()
        except Exception as error:
            raise InputError(
                self.path,
                f"its attachments and metadata cannot be read ({reason_of(error)})",
                "Have it repaired by mcap recover.",
            ) from error

    def __enter__(self) -> Self:
        with ExitStack() as stack:
            for path in self._paths:
                self.files.append(McapFile(path))
                stack.callback(self.files[-1].close)
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
