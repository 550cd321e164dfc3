"""The point clouds of one topic of a bag, by their numbers.

Clouds in sequence are read as they come in the bag. Access to others, or to the times of all, first
reads through the topic once, and keeps two numbers of each cloud.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from dataclasses import dataclass
from itertools import islice
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.bags.bag import Bag, Message
from derain.bags.cloud_message import CloudMessage, stamp_of
from derain.bags.point_cloud import PointField
from derain.bags.topics import Topic
from derain.errors import InputError
from derain.system.notices import warn

# Up to so many clouds ahead, reading on is quicker than a search.
NEAR = 8


@dataclass(frozen=True, eq=False)
class Stamps:
    """When the clouds of a topic were recorded and taken.

    Attributes:
        recorded: Nanoseconds, int64 (M,), of the bag's clock.
        taken: Nanoseconds, int64 (M,), of the publisher's clock; as ``recorded`` where a cloud has
            no stamp.
    """

    recorded: NDArray[np.int64]
    taken: NDArray[np.int64]

    @property
    def in_order(self) -> bool:
        """Whether the times of recording never decrease."""
        return bool((np.diff(self.recorded) >= 0).all())


class CloudTopic:
    """The clouds of a topic.

    Args:
        bag: The bag.
        topic: The topic, one of point clouds.
    """

    # State of this process: the open bag, the number of the cloud that it yields next, the message
    # that it yielded last, and what is known of all clouds.
    _reader: Any
    _messages: Iterator[Message]
    _next: int | None
    _last: tuple[int, Message] | None
    _stamps: Stamps | None
    _layouts: set[tuple[PointField, ...]]
    _first_of_stamp: dict[int, int]
    _warned_of_stamps: bool

    def __init__(self, bag: Bag, topic: Topic) -> None:
        self.bag = bag
        self.topic = topic
        self._forget()

    def __len__(self) -> int:
        return self.topic.messages

    def __getstate__(self) -> dict[str, Any]:
        # Other processes open the bag themselves.
        return {"bag": self.bag, "topic": self.topic}

    def __setstate__(self, state: dict[str, Any]) -> None:
        self.bag, self.topic = state["bag"], state["topic"]
        self._forget()

    def name_of(self, number: int) -> str:
        """The path of one of the clouds, which names it in messages."""
        return f"{self.bag.path}/{self.topic.name.strip('/')}/{number:06d}"

    def message(self, number: int) -> Message:
        """One of the messages, from 0.

        Raises:
            InputError: A bag that cannot be read, or that has fewer clouds than its index says.
        """
        with self._lock:
            if self._process != os.getpid():  # an open file of a process before the fork
                self._forget()
            if self._last is None or self._last[0] != number:
                self._last = number, self._read(number)
            return self._last[1]

    def cloud(self, number: int) -> CloudMessage:
        """The message of one of the clouds, from 0, parsed.

        Raises:
            InputError: As for :meth:`message`, or a damaged cloud.
        """
        message = self.message(number)
        try:
            cloud = CloudMessage.parse(message.data, self.topic.encoding)
        except ValueError as error:
            raise damaged_cloud(self.name_of(number), error) from error
        self._warn_of_other_fields(number, cloud.cloud.fields)
        self._warn_of_one_stamp(number, cloud.stamp)
        return cloud

    def seconds(self, number: int) -> float:
        """When one of the clouds was taken, seconds.

        Raises:
            InputError: As for :meth:`message`, or a damaged cloud.
        """
        if self._stamps is None and self._last is not None and self._last[0] == number:
            return 1e-9 * self._taken(number, self._last[1])
        return 1e-9 * float(self.stamps.taken[self._known(number)])

    @property
    def stamps(self) -> Stamps:
        """When all the clouds were recorded and taken; the first access reads through the topic."""
        if self._stamps is None:
            times = [
                (message.time, self._taken(number, message))
                for number, message in enumerate(self.bag.messages(self.topic))
            ]
            both = np.array(times, np.int64).reshape(-1, 2)
            self._stamps = Stamps(both[:, 0], both[:, 1])
        return self._stamps

    def _forget(self) -> None:
        self._lock = threading.Lock()
        self._process = os.getpid()
        self._open = ExitStack()  # closed with the last reference to this object
        self._reader = None
        self._messages = iter(())
        self._next = None
        self._last = None
        self._stamps = None
        self._layouts = set()
        self._first_of_stamp = {}
        self._warned_of_stamps = False

    def _read(self, number: int) -> Message:
        if self._next is None or not 0 <= number - self._next <= NEAR:
            self._begin_near(number)
        assert self._next is not None
        ahead, self._next = number - self._next, None  # until it went well
        message = next(islice(self._messages, ahead, None), None)
        if message is None:
            raise self._too_few()
        self._next = number + 1
        return message

    def _begin_near(self, number: int) -> None:
        """Begins to read shortly before a cloud, or at it."""
        first, start = 0, None
        if number > NEAR and self.stamps.in_order:
            # Several may have been recorded at one time.
            start = int(self.stamps.recorded[self._known(number)])
            first = int(np.searchsorted(self.stamps.recorded, start))
        if self._reader is None:
            self._reader = self._open.enter_context(self.bag.opened())
        self._messages = self.bag.messages_of(self._reader, self.topic, start)
        self._next = first

    def _taken(self, number: int, message: Message) -> int:
        try:
            return stamp_of(message.data, self.topic.encoding) or message.time
        except ValueError:  # reading the cloud raises it
            return message.time

    def _known(self, number: int) -> int:
        if number >= len(self.stamps.recorded):
            raise self._too_few()
        return number

    def _too_few(self) -> InputError:
        return InputError(
            self.bag.path,
            f"has fewer messages of {self.topic.name} than the {len(self):,} of its index",
            "Rebuild its index by `ros2 bag reindex` or `rosbag reindex`.",
        )

    def _warn_of_other_fields(self, number: int, fields: tuple[PointField, ...]) -> None:
        if self._layouts and fields not in self._layouts:
            names = ", ".join(field.name for field in fields)
            warn(
                f"{self.name_of(number)}: its fields differ from those of clouds before it; "
                f"it is read by its own ({names})"
            )
        self._layouts.add(fields)

    def _warn_of_one_stamp(self, number: int, stamp: int) -> None:
        """Warns of the first two clouds that have the same stamp."""
        first = self._first_of_stamp.setdefault(stamp, number)
        if stamp and first != number and not self._warned_of_stamps:
            self._warned_of_stamps = True
            warn(
                f"{self.name_of(number)}: has the stamp of {self.name_of(first)}; both are read, "
                "and no more of these are reported"
            )


def damaged_cloud(name: str, error: ValueError) -> InputError:
    """The error of a cloud whose message cannot be parsed."""
    return InputError(
        name,
        f"is a damaged PointCloud2: {error}",
        "Check the node that published it; other clouds are read.",
    )
