"""Bags written anew without the rain in their clouds."""

import os
import re
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from derain.bags.bag_copy import BagCopy
from derain.bags.bag_writer import written_name
from derain.bags.cleaning import cleaned
from derain.bags.cloud_message import CloudMessage
from derain.bags.cloud_topic import CloudTopic, damaged_cloud
from derain.bags.names import is_bag
from derain.errors import InputError
from derain.files.temporary import temporary_folder
from derain.sources.bag_frame import BagFrame
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement

# Names of topics in ROS 1 and ROS 2, of which each word begins with no digit.
# Source: http://wiki.ros.org/Names and https://design.ros2.org/articles/topic_and_service_names.html
ROS1_NAME = re.compile(r"/?[A-Za-z]\w*(/\w+)*", re.ASCII)
ROS2_NAME = re.compile(r"/?[A-Za-z_]\w*(/[A-Za-z_]\w*)*", re.ASCII)

# What the column of probabilities is called, of files and of clouds; its values are float32.
RAIN_PROBABILITY = "rain_probability"


@dataclass(frozen=True)
class BagOptions:
    """What is written of the clouds of a bag.

    Attributes:
        cleaned_topic: Name of the topic of clean clouds, beside the one that there is; None puts
            them in its place.
        removed_topic: Name of a topic of what was removed; None where nobody asks for it.
        keep_shape: Whether organised clouds stay organised.
    """

    cleaned_topic: str | None = None
    removed_topic: str | None = None
    keep_shape: bool = False


class CleanedBags:
    """Takes what was made of the clouds of whole bags, and writes each bag when it is complete.

    A cloud that nothing is made of stays as it is. Of a bag that cannot be written to its end,
    nothing is left.

    Args:
        out: The folder to write to.
        source: All frames that there will be; those of bags of which only some clouds are among
            them are left to others.
        options: What is written of each cloud.
        probability: Whether points have a field of their probability to be rain.

    Raises:
        InputError: Something is in the way of a bag, or options that contradict each other.
    """

    def __init__(
        self, out: Path, source: Iterable[Frame], options: BagOptions, probability: bool = False
    ) -> None:
        if options.cleaned_topic and options.cleaned_topic == options.removed_topic:
            raise InputError(
                "--removed-topic",
                f"{options.removed_topic} is --cleaned-topic too",
                "Name another.",
            )
        self.out = out
        self.options = options
        self.probability = probability
        self._whole = _whole_topics(source)
        for clouds in self._whole:
            self._refuse_clashes(clouds)
        self._stack = ExitStack()
        self._current: tuple[CloudTopic, BagCopy] | None = None
        self._broken: dict[CloudTopic, InputError] = {}
        self.written: list[Path] = []

    def takes(self, frame: Frame) -> bool:
        """Whether a frame is of a bag that is written anew."""
        return isinstance(frame, BagFrame) and frame.clouds in self._whole

    def targets(self) -> list[Path]:
        """Where bags are written."""
        return [self.out / written_name(clouds.bag) for clouds in self._whole]

    def write(self, judgement: Judgement) -> None:
        """Takes what a method says of a cloud; clouds come in the order of their bag.

        Raises:
            InputError: It cannot be written.
        """
        frame = judgement.frame
        assert isinstance(frame, BagFrame)
        copy = self._copy_of(frame.clouds)
        try:
            self._write(copy, frame, judgement)
        except InputError as error:
            if error.subject != frame.name:  # not this cloud alone
                self._break(frame.clouds, error)
            raise

    def __enter__(self) -> Self:
        return self

    def __exit__(self, kind: object, *_: object) -> None:
        with self._stack:
            if kind is not None:
                return
            self._finish()
        if self._broken:
            raise next(iter(self._broken.values()))

    def _write(self, copy: BagCopy, frame: BagFrame, judgement: Judgement) -> None:
        recorded = copy.forward_to(frame.number)
        options = self.options
        columns = {RAIN_PROBABILITY: judgement.probability} if self.probability else {}
        try:
            message = CloudMessage.parse(recorded.data, frame.clouds.topic.encoding)
            new = cleaned(message, judgement.rain, columns, options.keep_shape)
        except ValueError as error:
            copy.write(recorded)
            raise damaged_cloud(frame.name, error) from error
        if options.cleaned_topic:
            copy.write(recorded)
            copy.write(recorded, new.clean, options.cleaned_topic)
        else:
            copy.write(recorded, new.clean)
        if options.removed_topic:
            copy.write(recorded, new.removed, options.removed_topic)

    def _copy_of(self, clouds: CloudTopic) -> BagCopy:
        """The copy of a bag, begun with its first cloud; that of the bag before it is ended."""
        if clouds in self._broken:
            raise self._broken[clouds]
        if self._current is None or self._current[0] is not clouds:
            self._finish()
            try:
                folder = self._stack.enter_context(temporary_folder(self.out))
            except OSError as error:
                raise _unwritable(self.out, error) from error
            copy = self._stack.enter_context(BagCopy(clouds.bag, clouds.topic, folder))
            self._current = clouds, copy
        return self._current[1]

    def _finish(self) -> None:
        """Ends the copy that is being written, and puts it in its place."""
        if self._current is None:
            return
        clouds, copy = self._current
        try:
            with self._stack:
                self._current = None
                target = self.out / written_name(clouds.bag)
                _put(copy.finish(), target)
                self.written.append(target)
        except InputError as error:
            self._broken[clouds] = error

    def _break(self, clouds: CloudTopic, error: InputError) -> None:
        self._broken[clouds] = error
        self._current = None
        self._stack.close()

    def _refuse_clashes(self, clouds: CloudTopic) -> None:
        target, bag = self.out / written_name(clouds.bag), clouds.bag.path
        remedy = "Give --out another folder."
        there, within = Path(os.path.realpath(target)), Path(os.path.realpath(bag))
        if there in (within, within.parent):
            raise InputError(self.out, f"would overwrite {bag}", remedy)
        if there.is_relative_to(within):
            raise InputError(self.out, f"is inside {bag}", remedy)
        if os.path.lexists(target) and not is_bag(target):
            raise InputError(target, "is there already, and no bag", remedy)
        pattern = ROS1_NAME if clouds.bag.is_ros1 else ROS2_NAME
        names = {topic.name for topic in clouds.bag.topics}
        for option, name in (
            ("--cleaned-topic", self.options.cleaned_topic),
            ("--removed-topic", self.options.removed_topic),
        ):
            if name is not None and not pattern.fullmatch(name):
                raise InputError(
                    option,
                    f"{name!r} is not a name of a topic",
                    "Join words of letters, digits and _ by /, such as /points_clean.",
                )
            if name in names:
                raise InputError(option, f"{bag} has a topic {name} already", "Name another.")


def _whole_topics(source: Iterable[Frame]) -> list[CloudTopic]:
    """The topics all of whose clouds are in a source."""
    numbers: dict[CloudTopic, int] = {}
    for frame in source:
        if isinstance(frame, BagFrame):
            numbers[frame.clouds] = numbers.get(frame.clouds, 0) + 1
    return [clouds for clouds, count in numbers.items() if count == len(clouds)]


def _put(made: Path, target: Path) -> None:
    """Puts a bag where it belongs, in place of one that an earlier run wrote."""
    try:
        if target.is_dir() and not target.is_symlink():
            old = made.with_name(f"{made.name}.old")  # goes with the folder that it lies in
            os.replace(target, old)
        os.replace(made, target)
    except OSError as error:
        raise _unwritable(target, error) from error


def _unwritable(path: Path, error: OSError) -> InputError:
    return InputError(
        path,
        f"cannot be written ({error.strerror or error})",
        "Choose a folder that is writable and has room.",
    )
