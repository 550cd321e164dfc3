"""The point clouds of one topic of a bag, by their numbers.

Clouds in sequence are read as they come in the bag. Access to others, or to the times of all, first
reads through the topic once, and keeps two numbers of each cloud.
"""

import os
import threading
from collections.abc import Iterator
from contextlib import ExitStack
from itertools import islice
from typing import Any, Self

import numpy as np

from derain.bags.bag import Bag, Message
from derain.bags.cloud_message import CDR, ROS1, CloudMessage, stamp_of
from derain.bags.point_cloud import PointField
from derain.bags.topics import Topic
from derain.errors import InputError
from derain.scan import Ints
from derain.system.notices import warn

# Up to this many clouds ahead, reading on is quicker than a search.
NEAR = 8


class CloudTopic:
    """The clouds of a topic.

    Args:
        bag: The bag.
        topic: The topic, one of point clouds.

    Raises:
        InputError: Its messages have an encoding that ROS does not record.
    """

    def __init__(self, bag: Bag, topic: Topic) -> None:
        if topic.encoding not in (ROS1, CDR):
            raise InputError(
                bag.path,
                f"{topic.name} is encoded as '{topic.encoding}', not as {CDR} or {ROS1}",
                "Record the topic with ROS, or name another one with --topic.",
            )
        self.bag = bag
        self.topic = topic
        self._forget()

    def _forget(self) -> None:
        """Starts again, as another process does."""
        self._lock = threading.Lock()
        self._process = os.getpid()
        self._messages: Iterator[Message] = iter(())  # first, so that it ends before the bag closes
        self._open = ExitStack()  # closed with the last reference to this object
        self._reader: Any = None
        self._next: int | None = None  # number of the cloud that the messages yield next
        self._last: tuple[int, Message] | None = None  # the cloud that they yielded last
        self._times: Ints | None = None
        # Why there are no clouds after those whose times are known.
        self._end = self.bag.wrong_index(self.topic)
        self._layouts: set[tuple[PointField, ...]] = set()
        self._first_of_stamp: dict[int, int] = {}
        self._warned_of_stamps = False

    def __len__(self) -> int:
        return self.topic.messages

    def __reduce__(self) -> tuple[type[Self], tuple[Bag, Topic]]:
        return type(self), (self.bag, self.topic)  # another process opens the bag itself

    def name_of(self, number: int) -> str:
        """The path of one of the clouds, which names it in messages."""
        return f"{self.bag.path}/{self.topic.name.strip('/')}/{number:06d}"

    def message(self, number: int) -> Message:
        """One of the messages, from 0.

        Raises:
            InputError: A bag that cannot be read, or that has fewer clouds than its index names.
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
        """Time at which one of the clouds was taken, seconds.

        Raises:
            InputError: As for :meth:`message`, or a damaged cloud.
        """
        if self._times is None and self._last is not None and self._last[0] == number:
            return 1e-9 * self._taken(self._last[1])
        return 1e-9 * float(self._times_with(number)[number, 1])

    def _read(self, number: int) -> Message:
        if self._next is None or not 0 <= number - self._next <= NEAR:
            self._next = self._begin_near(number)
        ahead, self._next = number - self._next, None  # until it went well
        message = next(islice(self._messages, ahead, None), None)
        if message is None:
            raise self.bag.wrong_index(self.topic)
        self._next = number + 1
        return message

    def _begin_near(self, number: int) -> int:
        """Begins to read shortly before a cloud, or at it, and returns the number of the first."""
        first, start = 0, None
        if number > NEAR:
            recorded = self._times_with(number)[:, 0]
            if (np.diff(recorded) >= 0).all():
                start = int(recorded[number])
                first = int(np.searchsorted(recorded, start))  # several may have one time
        if self._reader is None:
            self._reader = self._open.enter_context(self.bag.opened())
        self._messages = self.bag.messages_of(self._reader, self.topic, start)
        return first

    def _times_with(self, number: int) -> Ints:
        """Time at which the clouds were recorded and taken, nanoseconds, (M, 2).

        The first call reads through the topic, up to the first damage. A cloud behind that, or one
        that the index alone names, raises an InputError.
        """
        if self._times is None:
            times: list[tuple[int, int]] = []
            messages = self.bag.messages(self.topic)
            try:  # extend keeps the clouds before the damage
                times.extend((each.time, self._taken(each)) for each in messages)
            except InputError as error:
                self._end = error
            self._times = np.array(times, np.int64).reshape(-1, 2)
        if number >= len(self._times):
            raise self._end.with_traceback(None)
        return self._times

    def _taken(self, message: Message) -> int:
        """The stamp of a cloud; when it was recorded, where it has none."""
        try:
            return stamp_of(message.data, self.topic.encoding) or message.time
        except ValueError:  # reading the cloud raises it
            return message.time

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
