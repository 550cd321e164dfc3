"""Point clouds in bags as frames."""

import os
import re
from dataclasses import dataclass, replace
from functools import partial
from hashlib import sha256
from pathlib import Path
from typing import Any, NoReturn

from derain.bags.bag import Bag
from derain.bags.cloud_topic import CloudTopic, damaged_cloud
from derain.bags.names import files_of, split, stem
from derain.bags.point_cloud import scan_of_cloud
from derain.errors import InputError
from derain.files.labels import LABEL
from derain.files.reading import file_size, reading, stamp_of
from derain.scan import Scan
from derain.sources.file_frame import FileFrame

# A bag `drive.mcap` has its labels beside it, in `drive.labels`.
LABELS_SUFFIX = ".labels"

NUMBER = re.compile(r"(?:(?P<topic>.*)/)?(?P<number>[0-9]{6,9})")


@dataclass(frozen=True, eq=False, kw_only=True)
class BagFrame(FileFrame):
    """A cloud in a bag, at a path as if the bag were a folder of its topics.

    Attributes:
        clouds: The clouds of its topic.
        cloud_number: Its number, from 0, also where its place in its sequence is another.
    """

    clouds: CloudTopic
    cloud_number: int

    @property
    def folder(self) -> Path:
        """The folder of the copy of its bag, relative to the folder of all results."""
        return Path(self.key).parent.parent

    @property
    def label_beside_bag(self) -> Path:
        """Path of its labels: ``drive.labels/000012.label`` beside the bag."""
        bag = Path(os.path.abspath(self.clouds.bag.path))  # the name of `.` is empty
        return bag.with_name(stem(bag) + LABELS_SUFFIX) / f"{self.cloud_number:06d}{LABEL}"

    @property
    def time(self) -> float:
        """Time of the cloud, seconds: the stamp of its header, or if that is 0, of the bag."""
        return self.clouds.seconds(self.cloud_number)

    def read(self) -> Scan:
        """Reads the scan, without labels."""
        cloud = self.clouds.cloud(self.cloud_number).cloud
        try:
            scan = scan_of_cloud(self.path, cloud)
        except ValueError as error:
            if isinstance(error, InputError):
                raise
            raise damaged_cloud(self.name, error) from error
        return scan.with_intensity_times(self.intensity_scale)

    def count_points(self) -> int:
        """Number of points of the cloud."""
        return len(self.clouds.cloud(self.cloud_number).cloud)

    def fingerprint(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of its message."""
        return sha256(self.clouds.message(self.cloud_number).data).hexdigest()[:16]

    def size(self) -> int:
        """Bytes of its share of the bag."""
        bag = self.clouds.bag.path
        with reading(bag):
            return sum(map(file_size, files_of(bag))) // max(len(self.clouds), 1)

    def stamp(self) -> str:
        """Size and time of change of the files of its bag and its labels; its place in the bag."""
        place = [self.clouds.topic.name, str(self.cloud_number)]
        stamps = map(stamp_of, files_of(self.clouds.bag.path))
        return " ".join([*stamps, *place]) + self._label_stamp()


@dataclass(frozen=True, eq=False, kw_only=True)
class UnreadableBag(FileFrame):
    """Stands for all clouds of a bag. What reads them, or asks for their labels, raises the error.

    Attributes:
        error: Why they cannot be listed.
    """

    error: InputError
    suffix = ""  # there is no file whose format an output could keep

    def _fail(self, *_: Any, **__: Any) -> NoReturn:
        raise self.error

    read = read_label = count_points = fingerprint = require_labels = _fail


def bag_frames(path: Path, labelled: bool = False, prefix: str = "") -> list[BagFrame]:
    """The clouds that a path into a bag names, in the order in which they were recorded.

    Args:
        path: A bag; a topic in it, ``bag/topic``; or one of its clouds, ``bag/topic/000012`` or
            ``bag/000012``.
        labelled: True if frames have their labels: ``<stem of the bag>.labels/000012.label``.
        prefix: First part of all keys; empty if the bag is the only one.

    Raises:
        InputError: A path that leads into no bag; a bag that cannot be read; no such topic or
            cloud; several topics of clouds, and none is named.
    """
    clouds, number = clouds_at(path)
    numbers = range(len(clouds)) if number is None else [number]
    if not len(clouds) or numbers[-1] >= len(clouds):
        raise InputError(
            path,
            f"there is no such cloud: {clouds.topic.name} has {len(clouds):,}",
            "Name another topic, or count from 000000.",
        )
    keys = (Path(prefix, f"{each:06d}").as_posix() for each in numbers)
    frames = map(partial(bag_frame, clouds), numbers, keys)
    return list(frames) if labelled else [frame.without_labels() for frame in frames]


def bag_frame(clouds: CloudTopic, number: int, key: str) -> BagFrame:
    """One of the clouds of a topic.

    Args:
        clouds: The clouds.
        number: Number of the cloud, from 0.
        key: Names the outputs of the frame.
    """
    frame = BagFrame(
        key=key,
        sequence=stem(clouds.bag.path),
        number=number,
        path=Path(clouds.name_of(number)),
        clouds=clouds,
        cloud_number=number,
    )
    return replace(frame, label_path=frame.label_beside_bag)


def clouds_at(path: Path) -> tuple[CloudTopic, int | None]:
    """The clouds of a topic in a bag, and the number of the one that a path names.

    Args:
        path: The topic, or one of its clouds, as if the bag were a folder; or the bag, if it has
            only one topic of clouds.

    Returns:
        The clouds; and the number, from 0, or None where the path names all of them.

    Raises:
        InputError: As for :func:`bag_frames`.
    """
    found = split(path)
    if found is None:
        raise InputError(path, "there is no such file or folder", "Check the path.")
    bag = Bag(found[0])
    topic, number = _topic_and_number(bag, found[1])
    return CloudTopic(bag, bag.cloud_topic(topic)), number


def _topic_and_number(bag: Bag, inner: str) -> tuple[str, int | None]:
    """The topic and the cloud that are named within a bag; a topic may be called like a number."""
    match = NUMBER.fullmatch(inner)
    if match is None or any(topic.name.strip("/") == inner for topic in bag.topics):
        return inner, None
    return match["topic"] or "", int(match["number"])
