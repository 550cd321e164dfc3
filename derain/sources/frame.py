"""One scan in its sequence: its properties before it is read."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from dataclasses import dataclass, replace
from hashlib import sha256
from pathlib import Path
from typing import Self

import numpy as np

from derain.cards.mixed import LabelMap
from derain.errors import InputError
from derain.files.extrinsics import check_rigid
from derain.scan import Floats, Ints, Scan


@dataclass(frozen=True, eq=False, kw_only=True)
class Frame(ABC):
    """A scan that a source can give, in its place in time and space.

    Attributes:
        key: Name of its results: a relative path without a suffix, such as
            ``000012`` or ``03/velodyne/000012``, which no other frame of its source has.
        sequence: Name of the recording that it belongs to; frames of one sequence are of one
            sensor, one after the other.
        number: Its place in its sequence, from 0.
        label_path: Path of its labels, existing or not; None if none are to be read.
        intensity_scale: Factor from its intensities to the required unit.
        sensor_to_world: Its pose, float64 (4, 4), metres, where it is given; None leaves it to
            what lies beside the scan.
        label_map: Takes its labels to the classes of several data sets that it is one of; None
            leaves them as they are.
    """

    key: str
    sequence: str = ""
    number: int = 0
    label_path: Path | None = None
    intensity_scale: float = 1.0
    sensor_to_world: Floats | None = None
    label_map: LabelMap | None = None

    @property
    @abstractmethod
    def name(self) -> str:
        """Its name in messages, such as the path of its file."""

    @property
    def suffix(self) -> str:
        """Suffix of its file's format, such as ``.pcd`` or ``.bin.gz``; empty if it has none."""
        return ""

    @property
    def time(self) -> float | None:
        """Time at which it was taken, seconds of the recording's clock; None if it is not known.

        Raises:
            InputError: A record of times that is damaged or does not fit the scans.
        """
        return None

    @property
    def pose(self) -> Floats | None:
        """Transformation from the sensor's frame to a fixed frame, float64 (4, 4), metres.

        None if it is not known.

        Raises:
            InputError: A record of poses that is damaged or does not fit the scans.
        """
        return self.sensor_to_world

    @property
    @abstractmethod
    def has_labels(self) -> bool:
        """True if its labels exist and are to be read."""

    def require_labels(self) -> None:
        """Refuses a scan without labels, where they are needed.

        Raises:
            InputError: It has none, or they are not where they are looked for.
        """
        if self.has_labels:
            return
        if self.label_path is None:
            remedy = "Leave the scan out, or find its labels by named_frames(..., labelled=True)."
            raise InputError(self.name, "it has no labels", remedy)
        folder = Path(self.name).absolute().parent
        layout = f"layout: {{scans: {folder.name}, labels: FOLDER}}"
        raise InputError(
            self.name,
            f"its labels are not at {self.label_path}",
            "Put them there or beside the scan. If they are in another folder of "
            f"{folder.parent}, name it in a YAML data card: `{layout}`.",
        )

    @abstractmethod
    def read(self) -> Scan:
        """Reads the scan, without labels.

        Raises:
            InputError: A file that cannot be read.
        """

    @abstractmethod
    def read_label(self, points: int) -> Ints:
        """Reads the semantic class ids of its points, int64 (N,), as its own data set has them.

        Args:
            points: N, the number of points of the scan.

        Raises:
            InputError: Labels that are missing, damaged, or not one for each point.
        """

    @abstractmethod
    def count_points(self) -> int:
        """Number of points of the scan, without reading more than that takes.

        Raises:
            InputError: A file that cannot be read.
        """

    @abstractmethod
    def fingerprint(self) -> str:
        """A fingerprint of its points, 16 hexadecimal digits.

        Raises:
            InputError: A file that cannot be read.
        """

    @abstractmethod
    def size(self) -> int:
        """Number of bytes to read.

        Raises:
            InputError: A file that is not there.
        """

    @abstractmethod
    def stamp(self) -> str:
        """A stamp that changes with the scan or its record of time and pose, read without the scan.

        Raises:
            InputError: A file that is not there.
        """

    def follows(self, other: "Frame") -> bool:
        """True if it is the next of the same recording, with none between."""
        return self.sequence == other.sequence and self.number == other.number + 1

    def without_labels(self) -> Self:
        """The same frame without its labels."""
        return replace(self, label_path=None)

    def with_pose(self, pose: Floats) -> Self:
        """The same frame at a given pose, in place of a pose in a file beside the scan.

        Args:
            pose: Sensor to world, float64 (4, 4), metres.

        Raises:
            InputError: A pose that is no rigid motion.
        """
        try:
            pose = np.asarray(pose, np.float64)
            check_rigid(pose)
        except (TypeError, ValueError) as error:
            reason = f"its pose is not rigid ({error})"
            raise InputError(self.name, reason, "Give a rotation and metres.") from error
        return replace(self, sensor_to_world=pose)

    def with_intensity_times(self, factor: float) -> Self:
        """The same frame, whose intensities are read in another unit.

        Written scans keep the intensities of their file: see
        :meth:`derain.scan.Scan.with_intensity_times`.

        Args:
            factor: The factor, such as 255 from 0..1 to 0..255.
        """
        return replace(self, intensity_scale=self.intensity_scale * factor)


@dataclass(frozen=True, eq=False, kw_only=True)
class MemoryFrame(Frame):
    """A scan that is in memory already, with its labels if it has any.

    Attributes:
        scan: The scan.
        time: Time at which it was taken, seconds; None if unknown.
    """

    scan: Scan
    time: float | None = None

    @property
    def name(self) -> str:
        """Its name in messages: as its scan is called."""
        return self.scan.name

    @property
    def has_labels(self) -> bool:
        """True if its scan has labels."""
        return self.scan.label is not None

    def read(self) -> Scan:
        """The scan, without labels."""
        return replace(self.scan, label=None).with_intensity_times(self.intensity_scale)

    def read_label(self, points: int) -> Ints:
        """The semantic class ids of its points, int64 (N,)."""
        if self.scan.label is None:
            raise InputError(self.name, "it has no labels", "Give the scan its labels.")
        return self.scan.label

    def count_points(self) -> int:
        """Number of points of the scan."""
        return len(self.scan)

    def fingerprint(self) -> str:
        """First 16 hexadecimal digits of the SHA-256 of its coordinates and intensities."""
        columns = (self.scan.xyz, self.scan.intensity)
        points = b"".join(np.ascontiguousarray(c).tobytes() for c in columns if c is not None)
        return sha256(points).hexdigest()[:16]

    def size(self) -> int:
        """Bytes of its coordinates."""
        return self.scan.xyz.nbytes

    def stamp(self) -> str:
        """A fingerprint of its points."""
        return self.fingerprint()

    def without_labels(self) -> Self:
        """The same frame without its labels."""
        return replace(self, label_path=None, scan=replace(self.scan, label=None))


def times_of(frames: Sequence[Frame]) -> list[float] | None:
    """Times at which frames were taken, seconds; None unless all are known.

    Raises:
        InputError: A record of times that is damaged or does not fit the scans.
    """
    times = [time for frame in frames if (time := frame.time) is not None]
    return times if len(times) == len(frames) else None


def time_of(frame: Frame) -> float | None:
    """Time at which a frame was taken, seconds; None without a record, or with a damaged one."""
    try:
        return frame.time
    except InputError:
        return None
