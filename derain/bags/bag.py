"""A bag: which topics it has, and its messages one after the other.

The library that reads bags has one exception for each thing that it checks, and whatever Python
raises for what it does not. Here each is one InputError.
"""

import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

from derain.bags.cloud_message import CDR, ROS1
from derain.bags.names import ROS1_SUFFIX
from derain.bags.vendors import decoder_of
from derain.errors import InputError, reason_of
from derain.files.extras import Extra

ROSBAGS = Extra("ros", "rosbags")

# ROS 1 calls it sensor_msgs/PointCloud2; the library gives both the longer name.
POINT_CLOUD = "sensor_msgs/msg/PointCloud2"


@dataclass(frozen=True)
class Topic:
    """One topic of a bag.

    Attributes:
        name: Its name.
        type: Type of its messages.
        messages: How many there are, as the bag's index has it.
    """

    name: str
    type: str
    messages: int

    def __str__(self) -> str:
        return f"{self.name} ({self.type}, {self.messages:,})"


class Message(NamedTuple):
    """One message of a bag.

    Attributes:
        connection: What the library knows of its topic.
        time: When it was recorded, nanoseconds.
        data: Its bytes.
    """

    connection: Any
    time: int
    data: bytes


class Bag:
    """A recording of ROS 1 or ROS 2, in whatever storage.

    Args:
        path: A file .bag, .mcap or .db3, or a folder with a metadata.yaml.
    """

    def __init__(self, path: Path) -> None:
        self.path = path

    @property
    def is_ros1(self) -> bool:
        """Whether ROS 1 recorded it."""
        return self.path.suffix.lower() == ROS1_SUFFIX and not os.path.isdir(self.path)

    @property
    def encoding(self) -> str:
        """How its messages are written: ``ros1`` or ``cdr``."""
        return ROS1 if self.is_ros1 else CDR

    @cached_property
    def topics(self) -> tuple[Topic, ...]:
        """Its topics, by name.

        Raises:
            InputError: A bag that cannot be read.
        """
        counts: dict[tuple[str, str], int] = {}
        with self.opened() as reader:
            for connection in reader.connections:
                name = (str(connection.topic), str(connection.msgtype))
                counts[name] = counts.get(name, 0) + max(connection.msgcount, 0)
        return tuple(Topic(*name, count) for name, count in sorted(counts.items()))

    def cloud_topic(self, name: str = "") -> Topic:
        """The topic of point clouds that is meant.

        Args:
            name: Its name; empty where the bag has only one of them.

        Raises:
            InputError: No such topic, one of another type, none at all, or several.
        """
        clouds = [topic for topic in self.topics if topic.type == POINT_CLOUD]
        if name:
            return self._named(name, clouds)
        filled = [topic for topic in clouds if topic.messages]
        if len(filled) == 1:
            return filled[0]
        if filled:
            raise InputError(
                self.path,
                f"has {len(filled)} topics of point clouds: {_listed(filled)}",
                f"Name one with --topic, or as {self.path}{filled[0].name}.",
            )
        raise InputError(
            self.path,
            f"holds no point clouds ({POINT_CLOUD}), but {_listed(self.topics)}",
            _remedy_without_clouds(self.topics),
        )

    @contextmanager
    def opened(self) -> Iterator[Any]:
        """Lends the library's reader of the bag, open.

        Raises:
            InputError: The library is not installed, or a bag that it cannot read; also what is
                found out while it is read in the block.
        """
        library = ROSBAGS.load(self.path, "rosbag1" if self.is_ros1 else "rosbag2")
        with self.reading(), library.Reader(self.path) as reader:
            yield reader

    @contextmanager
    def reading(self) -> Iterator[None]:
        """Tells what goes wrong while the bag is read.

        Raises:
            InputError: Anything but the end of a program went wrong.
        """
        try:
            yield
        except (InputError, BrokenPipeError):
            raise
        except Exception as error:  # the library checks little of what it reads
            raise InputError(
                self.path,
                f"cannot be read as a bag ({reason_of(error)})",
                "It is damaged, cut off, encrypted or of another kind. What was cut off may be "
                "saved by " + self._rescuer,
            ) from error

    def messages(self, topics: Iterable[str] = (), start: int | None = None) -> Iterator[Message]:
        """Its messages in time order, read while they are asked for.

        Args:
            topics: Names of the topics; none means all.
            start: The first time of interest, nanoseconds; None for the beginning.

        Raises:
            InputError: A bag that cannot be read.
        """
        wanted = set(topics)
        with self.opened() as reader:
            chosen = [c for c in reader.connections if not wanted or c.topic in wanted]
            if not chosen:
                return
            for connection, time, data in reader.messages(chosen, start=start):
                yield Message(connection, time, bytes(data))

    @property
    def _rescuer(self) -> str:
        if self.is_ros1:
            return "rosbag reindex."
        if os.path.isdir(self.path):
            return "ros2 bag reindex."
        return "mcap recover." if self.path.suffix.lower() == ".mcap" else "sqlite3's .recover."

    def _named(self, name: str, clouds: list[Topic]) -> Topic:
        same = [topic for topic in self.topics if topic.name.strip("/") == name.strip("/")]
        for topic in same:
            if topic.type == POINT_CLOUD:
                return topic
        if same:
            raise InputError(
                self.path,
                f"{same[0].name} is {same[0].type}, not {POINT_CLOUD}",
                _remedy_without_clouds(same),
            )
        raise InputError(
            self.path,
            f"has no topic {name}",
            f"Its topics of point clouds: {_listed(clouds)}.",
        )


def _listed(topics: Iterable[Topic]) -> str:
    return ", ".join(map(str, topics)) or "none"


def _remedy_without_clouds(topics: Iterable[Topic]) -> str:
    """What to do about topics that are not point clouds."""
    decoders = [(topic, decoder) for topic in topics if (decoder := decoder_of(topic.type))]
    if not decoders:
        return "Record the topic of point clouds, or name it with --topic."
    topic, decoder = decoders[0]
    return (
        f"{topic.name} is what a sensor or another node sent: {decoder} makes point clouds of it. "
        "Play the bag through that, and record what it publishes."
    )
