"""Copies of bags without the rain in their clouds."""

import os
import re
from collections import Counter
from collections.abc import Iterable
from contextlib import ExitStack
from dataclasses import dataclass, replace
from pathlib import Path

from derain.bags.bag_copy import BagCopy
from derain.bags.cloud_message import CloudMessage
from derain.bags.cloud_topic import CloudTopic, damaged_cloud
from derain.bags.names import is_bag, written_name
from derain.bags.point_cloud import PointCloud
from derain.errors import InputError
from derain.files.atomic import temporary_folder, writing
from derain.sources.bag_frame import BagFrame
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement

# Names of topics that both ROS 1 and ROS 2 allow.
# Source: http://wiki.ros.org/Names and https://design.ros2.org/articles/topic_and_service_names.html
TOPIC_NAME = re.compile(r"/?[A-Za-z]\w*(/[A-Za-z]\w*)*", re.ASCII)

# Name of the column of probabilities, float32, in files and in clouds.
RAIN_PROBABILITY = "rain_probability"


@dataclass(frozen=True)
class BagOptions:
    """Options for the written clouds of a bag.

    Attributes:
        cleaned_topic: Name of a further topic, of clean clouds; None replaces the clouds of the
            topic that is read.
        removed_topic: Name of a further topic, of the points that were removed; None for none.
        keep_shape: True if organised clouds stay organised.
    """

    cleaned_topic: str | None = None
    removed_topic: str | None = None
    keep_shape: bool = False


class CleanedBags:
    """Writes copies of whole bags, each with the clean clouds that it is given.

    A cloud without a result does not change. A bag that cannot be written to its end is removed.
    After the last cloud, :meth:`end` has to be called.

    Args:
        out: The folder to write to.
        source: All frames of the run. A bag is copied only if all its clouds are among them.
        options: Options for each cloud.
        probability: True if points get a field of their probability to be rain.

    Raises:
        InputError: A copy would replace or enter a bag that is read, or something that is no bag;
            or a topic has a name that ROS does not allow, that the bag has already, or that is
            given twice.
    """

    def __init__(
        self, out: Path, source: Iterable[Frame], options: BagOptions, probability: bool = False
    ) -> None:
        self.out = out
        self.options = options
        self.probability = probability
        self._targets = {
            clouds: out / folder / written_name(clouds.bag.path, clouds.bag.metadata is None)
            for clouds, folder in _whole_topics(source).items()
        }
        for clouds in self._targets:
            self._refuse_clashes(clouds)
        self._stack = ExitStack()
        self._current: tuple[CloudTopic, BagCopy] | None = None
        self._broken: dict[CloudTopic, InputError] = {}

    def takes(self, frame: Frame) -> bool:
        """True if a frame is of a bag that is copied."""
        return isinstance(frame, BagFrame) and frame.clouds in self._targets

    def targets(self) -> list[Path]:
        """Paths of the copies."""
        return list(self._targets.values())

    def write(self, judgement: Judgement) -> None:
        """Writes a cloud without its rain; clouds are given in the order of their bag.

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
                self._broken[frame.clouds] = error  # raised again for its next cloud
                self._current = None
                self._stack.close()
            raise

    def finish(self) -> dict[CloudTopic, InputError]:
        """Ends the last copy, and moves it into place.

        Returns:
            The bags whose copies could not be written, and why.
        """
        self._finish()
        broken, self._broken = self._broken, {}
        return broken

    def end(self, failed: bool) -> None:
        """Ends the last copy, unless :meth:`finish` has done so.

        Args:
            failed: True if not all clouds were written: the last copy is removed.

        Raises:
            InputError: One of the copies could not be written.
        """
        with self._stack:
            if failed:
                return
            broken = self.finish()
        if broken:
            raise next(iter(broken.values()))

    def _write(self, copy: BagCopy, frame: BagFrame, judgement: Judgement) -> None:
        recorded = copy.forward_to(frame.cloud_number)
        try:
            message = CloudMessage.parse(recorded.data, frame.clouds.topic.encoding)
            clean, removed = self._divided(message.cloud, judgement)
        except ValueError as error:
            copy.write(recorded)
            raise damaged_cloud(frame.name, error) from error
        if self.options.cleaned_topic:
            copy.write(recorded)
        copy.write(recorded, replace(message, cloud=clean).to_bytes(), self.options.cleaned_topic)
        if self.options.removed_topic:
            copy.write(
                recorded, replace(message, cloud=removed).to_bytes(), self.options.removed_topic
            )

    def _divided(self, cloud: PointCloud, judgement: Judgement) -> tuple[PointCloud, PointCloud]:
        """The cloud without its rain, and its rain alone.

        Raises:
            ValueError: A field of the probabilities' name and another type, or coordinates that
                cannot be NaN.
        """
        rain = judgement.rain
        if self.probability:
            cloud = cloud.with_field(RAIN_PROBABILITY, judgement.probability)
        whole = self.options.keep_shape and cloud.is_organised
        return (cloud.blank(rain) if whole else cloud.take(~rain)), cloud.take(rain)

    def _copy_of(self, clouds: CloudTopic) -> BagCopy:
        """The copy of a bag; for its first cloud, ends the copy before and begins a new one."""
        if clouds in self._broken:
            raise self._broken[clouds]
        if self._current is None or self._current[0] is not clouds:
            self._finish()
            with writing(self.out):
                folder = self._stack.enter_context(temporary_folder(self.out))
            copy = BagCopy(clouds.bag, clouds.topic, folder / self._targets[clouds].name)
            self._current = clouds, self._stack.enter_context(copy)
        return self._current[1]

    def _finish(self) -> None:
        """Ends the copy that is being written, and moves it into place."""
        if self._current is None:
            return
        clouds, copy = self._current
        self._current = None
        target = self._targets[clouds]
        try:
            with self._stack, writing(target):
                target.parent.mkdir(parents=True, exist_ok=True)
                _move(copy.finish(), target)
        except InputError as error:
            self._broken[clouds] = error

    def _refuse_clashes(self, clouds: CloudTopic) -> None:
        target, bag = self._targets[clouds], clouds.bag.path
        remedy = "Give --out another folder."
        there, within = Path(os.path.realpath(target)), Path(os.path.realpath(bag))
        if there in (within, within.parent):
            raise InputError(self.out, f"would overwrite {bag}", remedy)
        if there.is_relative_to(within):
            raise InputError(self.out, f"is inside {bag}", remedy)
        if os.path.lexists(target) and not is_bag(target):
            raise InputError(target, "exists, and is not a bag", remedy)
        names = {topic.name for topic in clouds.bag.topics}
        for option, name in (
            ("--cleaned-topic", self.options.cleaned_topic),
            ("--removed-topic", self.options.removed_topic),
        ):
            if name is None:
                continue
            if not TOPIC_NAME.fullmatch(name):
                raise InputError(
                    option,
                    f"{name!r} is not a name of a topic",
                    "Join words that begin with a letter by /, such as /points_clean.",
                )
            if name in names:
                raise InputError(option, f"there is a topic {name} already", "Name another.")
            names.add(name)


def _whole_topics(source: Iterable[Frame]) -> dict[CloudTopic, Path]:
    """The topics with all their clouds in a source, and the folders of their copies."""
    frames = [frame for frame in source if isinstance(frame, BagFrame)]
    folders = {frame.clouds: frame.folder for frame in frames}
    numbers = Counter(frame.clouds for frame in frames)
    return {clouds: folders[clouds] for clouds in folders if numbers[clouds] == len(clouds)}


def _move(made: Path, target: Path) -> None:
    """Moves a bag into place, over one that an earlier run wrote."""
    if target.is_dir() and not target.is_symlink():
        os.replace(target, made.with_name(f"{made.name}.old"))  # removed with its folder
    os.replace(made, target)
