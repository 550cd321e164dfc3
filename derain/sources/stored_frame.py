"""Scans and bags in object stores as frames, which are fetched to be read."""

from abc import abstractmethod
from dataclasses import dataclass, replace
from pathlib import Path
from typing import TypeVar

from derain.bags.names import written_name
from derain.errors import InputError
from derain.files import read_scan
from derain.scan import Floats, Scan
from derain.sources.bag_frame import bag_frames
from derain.sources.file_frame import FileFrame
from derain.sources.records import poses_along
from derain.sources.trajectory import Trajectory
from derain.stores.mirror import Mirror, mirror
from derain.stores.objects import StoredObject

Value = TypeVar("Value")


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredFrame(FileFrame):
    """A frame in an object store; its path only names it.

    Attributes:
        objects: The objects to fetch.
    """

    objects: tuple[StoredObject, ...]

    @abstractmethod
    def fetched(self, where: Mirror) -> list[FileFrame]:
        """The frames that it stands for, with all their files on this machine.

        Args:
            where: Place of its objects.

        Raises:
            InputError: A bag that cannot be read.
        """

    def size(self) -> int:
        """Bytes of its objects, as far as their store lists them."""
        return sum(stored.size or 0 for stored in self.objects)

    def stamp(self) -> str:
        """Sizes and versions of its objects."""
        return " ".join(stored.stamp for stored in self.objects)


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredScan(StoredFrame):
    """A scan in an object store. Each time it is read, it is fetched.

    Attributes:
        recorded_time: Its time, seconds, from the records beside it; or the error of a damaged one.
        recorded_pose: Its pose, float64 (4, 4), metres, likewise.
        records_stamp: Changes when these records do.
        file: Its path on this machine while it is fetched.
    """

    recorded_time: float | InputError | None = None
    recorded_pose: Floats | InputError | None = None
    records_stamp: str = ""
    file: Path | None = None

    @property
    def time(self) -> float | None:
        """Time at which it was taken, seconds."""
        return _value(self.recorded_time)

    @property
    def pose(self) -> Floats | None:
        """Sensor to world, float64 (4, 4), as it was given, or else of its records."""
        return _value(self.recorded_pose) if self.sensor_to_world is None else self.sensor_to_world

    def read(self) -> Scan:
        """Reads the scan, without labels."""
        if self.file is None:
            with mirror() as where:
                where.fetch(self.objects)
                return self.fetched(where)[0].read()
        scan = read_scan(self.file, self.columns).with_intensity_times(self.intensity_scale)
        return replace(scan, name=self.name)

    def stamp(self) -> str:
        """Size and version of its object, and of the records beside it."""
        return f"{super().stamp()} {self.records_stamp}"

    def fetched(self, where: Mirror) -> list[FileFrame]:
        """The scan in its file on this machine."""
        return [replace(self, file=where.root / self.path)]


@dataclass(frozen=True, eq=False, kw_only=True)
class StoredBag(StoredFrame):
    """All clouds of a topic of a bag in an object store, which are not known before it is fetched.

    Attributes:
        inner: The topic, as a part of a path; empty if the bag has only one of clouds.
        prefix: First part of the keys of its clouds; empty if the bag is the only one.
        time: Time of the cloud, seconds; None for all clouds.
        trajectory: Poses of the clouds, where they are given.
    """

    inner: str = ""
    prefix: str = ""
    time: float | None = None
    trajectory: Trajectory | None = None
    suffix = ""  # there is no file whose format an output could keep

    @property
    def written_path(self) -> Path:
        """Path of its copy in the folder of results."""
        is_file = any(each.path == self.path for each in self.objects)
        return Path(self.prefix).parent / written_name(self.path, is_file)

    def fetched(self, where: Mirror) -> list[FileFrame]:
        """Its clouds."""
        clouds = bag_frames(where.root / self.path / self.inner, prefix=self.prefix)
        frames: list[FileFrame] = [
            replace(
                cloud,
                path=cloud.path.relative_to(where.root),
                intensity_scale=self.intensity_scale,
                sensor_to_world=self.sensor_to_world,
            )
            for cloud in clouds
        ]
        if self.trajectory is None:
            return frames
        poses = poses_along(frames, self.trajectory)
        return [frame.with_pose(pose) for frame, pose in zip(frames, poses, strict=True)]

    def stamp(self) -> str:
        """Sizes and versions of its objects, and a fingerprint of the poses that are given."""
        poses = "" if self.trajectory is None else self.trajectory.fingerprint()
        return f"{super().stamp()} {poses}"

    def read(self) -> Scan:
        """Refuses: it has several clouds."""
        raise InputError(self.name, "is a bag, and no single scan", "Clean it by `derain run`.")


def _value(recorded: Value | InputError) -> Value:
    """The content of a record.

    Raises:
        InputError: It is damaged.
    """
    if isinstance(recorded, InputError):
        raise recorded
    return recorded
