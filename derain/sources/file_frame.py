"""A scan in a file, with what lies beside it."""

from dataclasses import dataclass
from hashlib import sha256
from pathlib import Path

from derain.errors import InputError
from derain.files import DEFAULT_COLUMNS, count_points, read_scan
from derain.files.labels import read_labels
from derain.files.names import scan_stem
from derain.files.reading import file_size, is_file, reading, stamp_of
from derain.scan import Floats, Ints, Scan, class_ids
from derain.sources.frame import Frame
from derain.sources.records import Records
from derain.stores.url import url_of

# Bytes at either end of a file that identify it; no two scans begin and end alike.
ENDS = 2**16


@dataclass(frozen=True, eq=False, kw_only=True)
class FileFrame(Frame):
    """A scan in a file.

    Attributes:
        path: The file.
        columns: Names of its columns, where it does not name them itself.
        records: Times and poses of the scans in its folder; None if none are to be read.
    """

    path: Path
    columns: tuple[str, ...] = DEFAULT_COLUMNS
    records: Records | None = None

    @property
    def name(self) -> str:
        """Its name in messages: its path, or the URL that it stands for."""
        return url_of(self.path)

    @property
    def suffix(self) -> str:
        """The suffix of its file, after the stem."""
        return self.path.name[len(scan_stem(self.path)) :]

    @property
    def time(self) -> float | None:
        """Time at which it was taken, seconds: see :class:`~derain.sources.records.Records`."""
        return None if self.records is None else self.records.time_of(self.path)

    @property
    def pose(self) -> Floats | None:
        """Sensor to world, float64 (4, 4), as it was given, or else of its records."""
        if self.sensor_to_world is not None or self.records is None:
            return self.sensor_to_world
        return self.records.pose_of(self.path)

    @property
    def has_labels(self) -> bool:
        """True if a file of labels is where they should be."""
        return self.label_path is not None and self.label_path.is_file()

    def read(self) -> Scan:
        """Reads the scan, without labels."""
        return read_scan(self.path, self.columns).with_intensity_times(self.intensity_scale)

    def read_label(self, points: int) -> Ints:
        """Reads the semantic class ids of its points, int64 (N,)."""
        if self.label_path is None:
            raise InputError(self.path, "it has no labels", "Give its label file.")
        return class_ids(read_labels(self.label_path, points))

    def count_points(self) -> int:
        """Number of points of the scan; of plain rows, by the size of the file."""
        return count_points(self.path, self.columns)

    def fingerprint(self) -> str:
        """A fingerprint of the content of its file, 16 hexadecimal digits."""
        with reading(self.path):
            size = file_size(self.path)
            with self.path.open("rb") as file:
                ends = file.read(ENDS)
                file.seek(max(size - ENDS, 0))
                ends += file.read(ENDS)
        return sha256(size.to_bytes(8, "little") + ends).hexdigest()[:16]

    def size(self) -> int:
        """Bytes of its file."""
        with reading(self.path):
            return file_size(self.path)

    def stamp(self) -> str:
        """Size and time of change of its file, its labels, and the records beside it."""
        records_stamp = "" if self.records is None else self.records.stamp
        return f"{stamp_of(self.path)} {records_stamp}{self._label_stamp()}"

    def _label_stamp(self) -> str:
        labels = self.label_path
        return f" {stamp_of(labels)}" if labels is not None and is_file(labels) else ""
