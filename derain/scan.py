"""One LiDAR scan, possibly fused with radar: the data everything in derain starts from."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, field, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Protocol, TypeVar, runtime_checkable

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError, reason_of

# No sensor measures beyond 1,000 km, and no intensity or other column reaches 10 million: what does
# is damaged. The bounds also keep every float32 computation downstream finite.
LARGEST_COORDINATE = 1e6
LARGEST_VALUE = 1e7

# If at least this many points all have one intensity, it was filled in and not measured. In a real
# scan up to 80 % of the points may share one value, such as 0: a hundred points share it by chance
# once in 10⁹ draws (.8¹⁰⁰), ten points once in ten. Fewer points of one intensity prove nothing.
FEWEST_ALIKE = 100

# SemanticKITTI-style range images mark a cell without a return by -1 in every column.
SENTINEL = -1.0

# Types of arrays: of float64, float32, int64, bool, and of any type. Docstrings give the shapes.
Floats = NDArray[np.float64]
Float32s = NDArray[np.float32]
Ints = NDArray[np.int64]
Bools = NDArray[np.bool_]
Array = NDArray[Any]

Named = TypeVar("Named")

# Ids of semantic classes have 16 bits. A label of 32 bits has its instance in the other 16.
LARGEST_ID = 0xFFFF

# No sensor gives this many columns: an array that is wider than this, and wider than long, holds
# its points as columns.
WIDEST_ARRAY = 64


@runtime_checkable
class PointHeader(Protocol):
    """A header that describes single points, such as by their text."""

    def take(self, rows: NDArray[Any]) -> "PointHeader":
        """The same of some points only, by their row numbers or a bool mask of shape (N,)."""


@dataclass(frozen=True, eq=False)
class Scan:
    """One point cloud, in the order of its file; rows are never dropped or reordered.

    A scan copies the arrays that it is given, so that a buffer may be filled again while scans made
    of it are in use. What a masked array masks is NaN.

    Example:
        >>> scan = Scan.of(np.array([[8.0, 6.0, 0.0, 0.5], [0.0, 0.0, 0.0, 0.0]]))
        >>> scan.range
        array([10.,  0.], dtype=float32)
        >>> scan.valid  # the second point, at the sensor itself, is a beam that met nothing
        array([ True, False])

    Attributes:
        xyz: Coordinates, float32 (N, 3), metres in the sensor frame (x forward, y left, z up).
        intensity: Return intensity, float32 (N,), in the file's own unit; None where the file has
            none.
        label: Semantic class ids, int64 (N,), or None. Whole numbers of any dtype are converted;
            of uint32 labels, as in label files, the class is in the low 16 bits.
        radar: True for points of the radar, bool (N,), or None where the source is not known.
        fields: Every column of the file as it was read, by name, each of N rows in its own dtype;
            what a writer needs to give the file back bit for bit. Read-only. Empty for a scan made
            in memory.
        shape: (height, width) of an organised cloud, rows in row-major order; else None.
        name: Source of the scan, for messages.
        header: The content of the file besides its columns, such as the encoding of a PCD. Only the
            writer of the same format looks into it. One that speaks of single points is a
            PointHeader; one of a file with parts that are not written has their names as
            ``left_out``, a tuple.

    Raises:
        InputError: Columns of different lengths, of another shape or without numbers; class ids
            that are not whole.
    """

    xyz: Float32s
    intensity: Float32s | None = None
    label: Ints | None = None
    radar: Bools | None = None
    fields: Mapping[str, Array] = field(default_factory=dict)
    shape: tuple[int, int] | None = None
    name: str = "scan"
    header: object = None

    def __post_init__(self) -> None:
        for title, convert in _CONVERTERS.items():
            if getattr(self, title) is not None:
                object.__setattr__(self, title, self._copied(title, convert))
        if self.xyz.ndim != 2 or self.xyz.shape[1] != 3:
            raise InputError(
                self.name,
                f"coordinates have shape {self.xyz.shape}",
                "Give an array of shape (N, 3).",
            )
        if any(column.flags.writeable for column in self.fields.values()):
            own = {title: _read_only(column) for title, column in self.fields.items()}
            object.__setattr__(self, "fields", own)
        columns = [("intensity", self.intensity), ("label", self.label), ("radar", self.radar)]
        shapes = [(title, column.shape) for title, column in columns if column is not None]
        shapes += [(title, column.shape[:1]) for title, column in self.fields.items()]
        for title, shape in shapes:
            if shape != (len(self.xyz),):
                reason = f"{title} has shape {shape} for {len(self.xyz)} points"
                raise InputError(self.name, reason, "Give one value per point.")

    def _copied(self, title: str, convert: Callable[[Any], Array]) -> Array:
        """A copy of a column that was given, in the dtype that it has in a scan."""
        try:
            return convert(getattr(self, title))
        except (TypeError, ValueError, RuntimeError) as error:  # the last of tensors of PyTorch
            raise InputError(
                self.name,
                f"{title} cannot be converted ({reason_of(error)})",
                "Give an array of numbers.",
            ) from error

    @classmethod
    def of(cls, points: "Scan | Array", name: str = "array") -> "Scan":
        """Makes a scan of an array of points, which is copied; a Scan comes back as it is.

        Args:
            points: A Scan, or (N, ≥ 3) numbers: x, y, z in metres, then intensity if there is a
                fourth column. Further columns are ignored.
            name: Name of the array in messages.

        Raises:
            InputError: Something else than an array of numbers, or one of another shape.
        """
        if isinstance(points, Scan):
            return points
        given: object = points  # whatever a user gave
        if isinstance(given, str | Path):
            raise InputError(given, "a path is not an array of points", "Use derain.read_scan.")
        remedy = "Give an array of shape (N, 4): a row for each point."
        try:
            array = points if isinstance(points, np.ma.MaskedArray) else np.asarray(points)
        except (TypeError, ValueError, RuntimeError) as error:
            reason = f"points cannot be converted to an array ({reason_of(error)})"
            raise InputError(name, reason, remedy) from error
        width = array.shape[1] if array.ndim == 2 else 0
        if width < 3 or has_points_as_columns(len(array), width):
            raise InputError(name, f"points have shape {array.shape}", remedy)
        return cls(array[:, :3], array[:, 3] if width > 3 else None, name=name)

    def __len__(self) -> int:
        return len(self.xyz)

    @property
    def left_out(self) -> tuple[str, ...]:
        """Names of the parts of its file that are not written with it; mostly none."""
        return getattr(self.header, "left_out", ())

    @cached_property  # the range view, its channel and the metrics ask for it in turn
    def range(self) -> Float32s:
        """Distance of every point from the sensor, float32 (N,), metres."""
        with np.errstate(invalid="ignore"):
            x, y, z = np.ascontiguousarray(self.xyz.T, dtype=np.float64)
            return to_float32(np.sqrt(x * x + y * y + z * z))

    @cached_property  # views, filters and warnings ask for it in turn
    def measured_intensity(self) -> Float32s | None:
        """Intensity where the sensor measured it, float32 (N,), in the file's own unit.

        None where the file has none, and where its column was only filled: with one value at all
        valid points, 100 or more, or with nothing finite.
        """
        if self.intensity is None or not self._knows_intensity:
            return None
        values = self.intensity[self.valid]
        alike = len(values) >= FEWEST_ALIKE and values.min() == values.max()
        return None if alike else self.intensity

    @cached_property  # whatever looks at a scan needs it
    def valid(self) -> Bools:
        """True for the points that can be judged, bool (N,), read-only.

        Not valid: coordinates or intensity not finite or beyond any sensor's reach, points exactly
        at the origin (no return), and cells that hold −1 in every column (no return in
        SemanticKITTI-style range images). A column of intensity without one finite value
        counts for no point.
        """
        # Column by column, which is several times faster than along the short axis. A comparison
        # with NaN is False, so the bounds refuse NaN and infinity as well.
        at_origin, sentinel = np.ones(len(self), bool), np.ones(len(self), bool)
        valid = np.ones(len(self), bool)
        for column in np.ascontiguousarray(self.xyz.T):
            valid &= np.abs(column) <= LARGEST_COORDINATE
            at_origin &= column == 0
            sentinel &= column == SENTINEL
        if self.intensity is not None and self._knows_intensity:
            valid &= np.abs(self.intensity) <= LARGEST_VALUE
            sentinel &= self.intensity == SENTINEL
        valid &= ~(at_origin | sentinel)
        valid.setflags(write=False)  # it is everybody's
        return valid

    @cached_property
    def lacks_intensity(self) -> Bools:
        """True for points that would be valid if their intensity was possible, bool (N,)."""
        if self.valid.all():
            return ~self.valid
        return replace(self, intensity=None).valid & ~self.valid

    def channel(self, name: str) -> Float32s | None:
        """One value per point, by name.

        Args:
            name: ``x``, ``y``, ``z`` or ``range`` (metres); ``intensity``; ``radar`` (1 for points
                of the radar, 0 for others); or a column of numbers in ``fields``, in upper or lower
                case.

        Returns:
            float32 (N,), in the column's own unit; NaN where a column of ``fields`` holds nothing
            finite or what no sensor measures. None where the scan has no such channel, or an
            intensity that was not measured.

        Raises:
            InputError: Several columns could be meant: see :func:`named`.
        """
        match name:
            case "x" | "y" | "z":
                return self.xyz[:, "xyz".index(name)]
            case "range":
                return self.range
            case "intensity":
                return self.measured_intensity
            case "radar" if self.radar is not None:
                return to_float32(self.radar)
        column = named(self.fields, name, self.name)
        values = None if column is None else flattened(column)
        if values is None or values.ndim > 1 or values.dtype.kind not in "biuf":
            return None
        values = to_float32(values)
        return np.where(np.abs(values) <= LARGEST_VALUE, values, np.float32(np.nan))

    def with_label(self, label: Array) -> "Scan":
        """The same scan with semantic class ids, whole numbers (N,), which are copied.

        Raises:
            InputError: Other than one whole number for each point.
        """
        return replace(self, label=label)

    def with_intensity_times(self, factor: float) -> "Scan":
        """The same scan with its intensities in another unit; what was read stays in `fields`.

        Cells without a return, which hold −1, keep it: that is a mark and no intensity.

        Args:
            factor: Factor of every intensity, such as 255 to go from 0..1 to 0..255.

        Raises:
            InputError: A factor that is not a finite number above 0.
        """
        if not (factor > 0 and math.isfinite(factor)):
            raise InputError("intensity_scale", f"it is {factor:g}", "Give a number above 0.")
        if self.intensity is None or factor == 1:
            return self
        scaled = self.intensity * np.float32(factor)
        empty = self.intensity == SENTINEL
        return replace(self, intensity=np.where(empty, self.intensity, scaled))

    def take(self, rows: Array) -> "Scan":
        """The scan of some rows only, as an unorganised cloud.

        Args:
            rows: Row numbers, or a bool mask of shape (N,).
        """

        def pick(column: Array | None) -> Array | None:
            return None if column is None else column[rows]

        header = self.header
        return Scan(
            self.xyz[rows],
            pick(self.intensity),
            pick(self.label),
            pick(self.radar),
            {title: column[rows] for title, column in self.fields.items()},
            name=self.name,
            header=header.take(rows) if isinstance(header, PointHeader) else header,
        )

    @cached_property
    def _knows_intensity(self) -> bool:
        """True if any intensity is a number that a sensor can measure."""
        assert self.intensity is not None
        return bool((np.abs(self.intensity) <= LARGEST_VALUE).any())


def named(columns: Mapping[str, Named], name: str, subject: str | Path) -> Named | None:
    """The column of a name: the one spelt exactly so, else the one that differs in case alone.

    Example:
        >>> named({"X": 1, "x": 2, "Ring": 3}, "x", "scan.csv")
        2
        >>> named({"X": 1, "x": 2, "Ring": 3}, "ring", "scan.csv")
        3

    Args:
        columns: Columns by name.
        name: The name.
        subject: Name of the file in messages.

    Returns:
        None where there is no such column.

    Raises:
        InputError: Several columns differ from the name in case alone.
    """
    if name in columns:
        return columns[name]
    alike = [title for title in columns if title.lower() == name.lower()]
    if len(alike) > 1:
        raise InputError(
            subject,
            f"the columns {' and '.join(alike)} differ in case alone, and none is called {name}",
            f"Rename the one that is meant to {name}.",
        )
    return columns[alike[0]] if alike else None


def has_points_as_columns(rows: int, width: int) -> bool:
    """True if an array is so much wider than long that its points must be its columns."""
    return width > max(rows, WIDEST_ARRAY)


def flattened(column: Array) -> Array:
    """A column (N, 1) as (N,), any other as it is: files hold one value per point in both ways."""
    return column.reshape(-1) if column.shape[1:] == (1,) else column


def to_float32(array: Array) -> Float32s:
    """Converts to contiguous float32; what is beyond its reach becomes infinite, silently."""
    with np.errstate(over="ignore", invalid="ignore"):
        return np.ascontiguousarray(array, dtype=np.float32)


def class_ids(label: Array) -> Ints:
    """A copy of semantic class ids, int64 (N,); of uint32, as in label files, the low 16 bits.

    Raises:
        ValueError: Numbers that are not whole.
    """
    label = np.asarray(label)
    if label.dtype == np.uint32:
        label = label & LARGEST_ID
    with np.errstate(invalid="ignore"):
        ids = label.astype(np.int64)
    if label.dtype.kind not in "biu" and not (ids == label).all():
        raise ValueError("class ids have to be whole numbers")
    return ids


def _copied_to_float32(values: Array) -> Float32s:
    if np.iscomplexobj(values):
        raise TypeError("it is of complex numbers")  # NumPy would drop the imaginary part
    with np.errstate(over="ignore", invalid="ignore"):
        if isinstance(values, np.ma.MaskedArray):
            values = np.ma.filled(values.astype(np.float32), np.nan)
        return np.array(values, np.float32, order="C")


# What makes a column of a scan of an array that is given.
_CONVERTERS: dict[str, Callable[[Any], Array]] = {
    "xyz": _copied_to_float32,
    "intensity": _copied_to_float32,
    "label": class_ids,
    "radar": lambda values: np.array(values, bool),
}


def _read_only(array: Array) -> Array:
    """The array itself if it is read-only, else a read-only copy."""
    if array.flags.writeable:
        array = array.copy()
        array.setflags(write=False)
    return array
