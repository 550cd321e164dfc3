"""Copies a bag message by message, with other clouds in one of its topics."""

from contextlib import AbstractContextManager, ExitStack
from pathlib import Path
from typing import Any, Self

from derain.bags.bag import Bag, Message, library_errors
from derain.bags.rosbags_writer import RosbagsWriter
from derain.bags.topics import Topic


class BagCopy:
    """A copy of a bag, written up to one of the clouds of a topic at a time.

    It has its own reader of the bag, and so holds one message, however many clouds a method reads
    ahead. Messages that are not replaced are copied byte for byte.

    Args:
        bag: The bag.
        topic: Its topic of clouds.
        path: Path of the copy, whose name is that of :func:`derain.bags.names.written_name`; the
            caller removes an incomplete one.

    Raises:
        InputError: A bag that cannot be read, or a copy that cannot be written.
    """

    def __init__(self, bag: Bag, topic: Topic, path: Path) -> None:
        self.bag = bag
        self.topic = topic
        self._stack = ExitStack()
        reader = self._stack.enter_context(bag.opened())
        self._messages = bag.messages_of(reader)
        self._clouds = 0
        self.path = path
        with self._writing():
            self._writer = _writer(bag, reader, path)
            for connection in reader.connections:  # as many, and in the same order
                self._writer.connection(connection)

    def forward_to(self, number: int) -> Message:
        """Copies the messages before one of the clouds.

        Args:
            number: The cloud, from 0; greater than in earlier calls.

        Returns:
            The cloud's message, which is not written yet.

        Raises:
            InputError: The bag cannot be read on, has no such cloud, or the copy cannot be written.
        """
        for message in self._messages:
            if self.topic.has(message.connection):
                self._clouds += 1
                if self._clouds > number:
                    return message
            self.write(message)
        raise self.bag.wrong_index(self.topic)

    def write(self, message: Message, data: bytes | None = None, topic: str | None = None) -> None:
        """Writes a message, or another one at its time.

        Args:
            message: The message of the bag.
            data: Other bytes; None for its own.
            topic: Another topic of the same kind; None for its own.

        Raises:
            InputError: The copy cannot be written.
        """
        with self._writing():
            connection = self._writer.connection(message.connection, topic)
            self._writer.write(connection, message, message.data if data is None else data)

    def finish(self) -> Path:
        """Copies the rest.

        Returns:
            The path of the copy.

        Raises:
            InputError: The bag cannot be read on, has more or fewer clouds than its index names, or
                the copy cannot be written.
        """
        for message in self._messages:
            self._clouds += self.topic.has(message.connection)
            self.write(message)
        if self._clouds != self.topic.messages:
            raise self.bag.wrong_index(self.topic)
        with self._writing():
            self._writer.close()
        self._stack.close()
        return self.path

    def __enter__(self) -> Self:
        return self

    def __exit__(self, *_: object) -> None:
        with self._writing():
            self._writer.abort()  # does nothing to a finished copy
        self._stack.close()

    def _writing(self) -> AbstractContextManager[None]:
        """Turns the errors of writing the copy into an InputError."""
        return library_errors(
            self.bag.path,
            "its copy cannot be written",
            "Choose a folder that is writable and has room; repair a bag that is damaged.",
        )


def _writer(bag: Bag, reader: Any, path: Path) -> Any:
    if bag.storage != "mcap":
        return RosbagsWriter(bag, reader, path)
    from derain.bags.mcap_writer import McapWriter

    return McapWriter(reader, bag.metadata, path)
