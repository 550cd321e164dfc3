"""Point clouds of laser surveys (`.las`, compressed `.laz`), read and written by laspy.

Source: ASPRS, "LAS Specification", version 1.4 R15; LASzip, "LASzip compressed point data", the
record of user id "laszip encoded" and the layered chunks of point formats 6 to 10.
"""

import io
import struct
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from copy import deepcopy
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.columns import Columns, columns_of, no_place, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.files.names import scan_suffix
from derain.files.text import encode
from derain.scan import LARGEST_COORDINATE, Array, Floats, Ints, Scan
from derain.system.extras import LASPY

# Sizes of the header, up to version 1.3 and from 1.4 on.
_HEADER, _HEADER_1_4 = 227, 375

# Sizes of the fixed part of a variable-length record, and of an extended one.
_RECORD, _EXTENDED_RECORD = 54, 60

# Beyond this from the file's offset, float32 would lose more than a few millimetres.
_FAR = 1e5

# Types of extra dimensions, in NumPy's spelling, and bytes of their names.
EXTRA_TYPES = ("u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8")
LONGEST_NAME = 32

# Layers of an item of a point, by the item's type: a point, colours, near infrared, waveforms.
_LAYERS = {10: 9, 11: 1, 12: 2, 13: 1}

# Further bytes have a layer each.
_EXTRA_BYTES = 14

# No survey is finer than this, in metres.
_FINEST_SCALE = 1e-12


@dataclass(frozen=True, eq=False)
class LasHeader:
    """The content of a LAS file besides its points.

    Attributes:
        header: laspy's.
        origin: Whole numbers that stand for the origin of the scan's coordinates, int64 (3,).
    """

    header: Any
    origin: Ints


@FORMATS.add(".las", ".laz")
class Las(Format):
    """Laser surveys, version 1.0 to 1.4, as they are or compressed."""

    HELP = "laser surveys"
    DAMAGE = (Exception,)
    EXTRA = LASPY

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads a LAS or LAZ file.

        Surveys have coordinates of millions of metres, which float32 holds to decimetres. The
        scan's coordinates are therefore relative to the offset that the file states, or, where they
        would still be farther than 100 km from it, to their median.

        Args:
            content: The file, version 1.0 to 1.4.
            columns: Not used: a survey names its columns.

        Returns:
            The scan: x, y and z are float64, metres; every other column is as the file stores it,
            so that a column may hold several values in its bits.

        Raises:
            InputError: A file that is damaged, or laspy is not installed.
        """
        laspy = LASPY.load(content.path)
        with _panics_as_errors():
            header, raw = _points(laspy, content)
        whole = np.stack([raw[axis] for axis in "XYZ"], axis=1).astype(np.int64)
        origin = _origin(whole, header.scales)
        near = (whole - origin) * header.scales
        fields = {axis: near[:, place] for place, axis in enumerate("xyz")}
        fields |= {name: raw[name] for name in raw.dtype.names or () if name not in ("X", "Y", "Z")}
        return scan_of(content.path, fields, header=LasHeader(header, origin))

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as the points of the LAS file that it came from.

        Columns of numbers that the file did not have become extra dimensions.

        Raises:
            InputError: A scan of another format, or without a column that its points need; a column
                that is no extra dimension, or coordinates beyond its reach; laspy is not installed.
        """
        laspy = LASPY.load(path)
        columns = columns_of(scan)
        if not isinstance(scan.header, LasHeader):
            raise _refused(path)
        header, origin = scan.header.header, scan.header.origin
        names: tuple[str, ...] = header.point_format.dtype().names
        stored = {name.lower() if name in ("X", "Y", "Z") else name for name in names}
        further = {name: column for name, column in columns.items() if name not in stored}
        header = _with_dimensions(laspy, path, header, further)
        points = laspy.ScaleAwarePointRecord.zeros(len(scan), header=header)
        if not columns.keys() >= stored:
            raise _refused(path)
        for name, column in columns.items():
            if name in ("x", "y", "z"):
                place = "xyz".index(name)
                numbers = column / header.scales[place] + origin[place]
                points.array[name.upper()] = _stored(path, numbers)
            else:
                points.array[name] = column
        try:
            return _to_bytes(laspy, header, points, scan_suffix(path) == ".laz")
        except laspy.errors.LaspyException as error:
            raise InputError(path, f"laspy cannot write it ({error})", "Write .npz.") from error


@contextmanager
def _panics_as_errors() -> Iterator[None]:
    """Converts panics of laspy's Rust library, which are no Exception, to errors."""
    try:
        yield
    except BaseException as error:
        if type(error).__name__ != "PanicException":
            raise
        raise ValueError(str(error)) from error


def _with_dimensions(laspy: ModuleType, path: Path, header: Any, columns: Columns) -> Any:
    """The header with room for further columns; itself if there are none."""
    if not columns:
        return header
    header = deepcopy(header)
    for name, column in columns.items():
        known = column.ndim == 1 and column.dtype.str[1:] in EXTRA_TYPES
        if not known or len(encode(name)) > LONGEST_NAME:
            raise no_place(path, name, column)
        header.add_extra_dim(laspy.ExtraBytesParams(name, column.dtype))
    return header


def _refused(path: Path) -> InputError:
    reason = f"only a scan read from a {scan_suffix(path)} can be written as one"
    return InputError(path, reason, "Write .npz.")


def _points(laspy: ModuleType, content: Content) -> tuple[Any, Array]:
    """Laspy's header of a file, and the file's points as they are stored, structured (N,)."""
    _check_counts(content)
    with laspy.open(io.BytesIO(content.data), laz_backend=laspy.LazBackend.Lazrs) as file:
        header = file.header
        if header.are_points_compressed:
            (record,) = header.vlrs.get("LasZipVlr")
            begin = header.offset_to_point_data
            _check_chunks(content, record.record_data, header.point_format.size, begin)
        raw = file.read().points.array
    if not np.isfinite(header.offsets).all():
        raise ValueError(f"the offsets of the coordinates are {header.offsets}")
    if {"x", "y", "z"} & set(raw.dtype.names):
        raise ValueError("a further column is called x, y or z")
    if len(raw) < header.point_count:
        raise ValueError(f"{len(raw)} points where the header states {header.point_count}")
    return header, raw


def _to_bytes(laspy: ModuleType, header: Any, points: Any, compress: bool) -> bytes:
    """A file of laspy's header and points."""
    file = io.BytesIO()
    with laspy.LasWriter(
        file,
        header.copy(),
        do_compress=compress,
        laz_backend=laspy.LazBackend.Lazrs,  # one thread, so that every machine writes the same
        closefd=False,
        encoding_errors="ignore",  # the header's texts should be ASCII, and not all are
    ) as writer:
        writer.write_points(points)
        if header.evlrs:
            writer.write_evlrs(header.evlrs)
    return file.getvalue()


def _check_counts(content: Content) -> None:
    """Refuses a header that states more records or points than the file can hold."""
    data = content.data
    if data[:4] != b"LASF" or len(data) < (_HEADER_1_4 if data[25:26] >= b"\4" else _HEADER):
        raise ValueError("no LAS header")
    (records,), extended = struct.unpack_from("<I", data, 100), 0
    size, points = struct.unpack_from("<HI", data, 105)
    if data[25] >= 4:  # the minor version
        extended, points = struct.unpack_from("<IQ", data, 243)
    if records * _RECORD + extended * _EXTENDED_RECORD > len(data):
        raise ValueError(f"{records + extended:,} records in the header")
    content.budget.reserve(points * size)


def _check_chunks(content: Content, record: bytes, size: int, begin: int) -> None:
    """Refuses a LAZ file whose chunks exceed it, because laspy allocates the size that they state.

    Args:
        content: The file.
        record: The variable-length record of how the points are compressed.
        size: Bytes of a point.
        begin: Begin of the compressed points.

    Raises:
        ValueError: Points of another size than the header's, more chunks than the file can hold, or
            a layer that is not in it.
        struct.error: A file that is cut off.
    """
    items = list(struct.iter_unpack("<HHH", record[34:]))
    (stated,) = struct.unpack_from("<H", record, 32)
    if stated != len(items) or sum(item_size for _, item_size, _ in items) != size:
        raise ValueError("compressed points of another size than the header's")
    data = content.data
    (table,) = struct.unpack_from("<q", data, begin)
    if table == -1:  # the file was written as a stream
        (table,) = struct.unpack_from("<q", data, len(data) - 8)
    if not begin < table < len(data):
        raise ValueError("the table of chunks is not in the file")
    _, chunks = struct.unpack_from("<II", data, table)
    if chunks > len(data):
        raise ValueError(f"{chunks:,} chunks in the header")
    layers = sum(
        item_size if kind == _EXTRA_BYTES else _LAYERS.get(kind, 0) for kind, item_size, _ in items
    )
    if layers:
        _check_layers(data, begin + 8, table, size, layers)


def _check_layers(data: bytes, begin: int, end: int, size: int, layers: int) -> None:
    """Refuses chunks whose layers are not in the file.

    A chunk is its first point, the number of its points, the sizes of its layers, and the layers.
    """
    while begin < end:
        place = begin + size + 4
        sizes = struct.unpack_from(f"<{layers}I", data, place)
        begin = place + 4 * layers + sum(sizes)
    if begin > end:
        raise ValueError("a chunk that is not in the file")


def _origin(whole: Ints, scales: Floats) -> Ints:
    """The origin of the scan's coordinates."""
    if not ((scales > _FINEST_SCALE) & (scales < LARGEST_COORDINATE)).all():
        raise ValueError(f"the scales of the coordinates are {scales}")
    if not len(whole):
        return np.zeros(3, np.int64)
    median = np.median(whole, axis=0).astype(np.int64)
    return np.where(np.abs(median * scales) > _FAR, median, 0)


def _stored(path: Path, numbers: Floats) -> NDArray[np.int32]:
    """Coordinates as LAS stores them."""
    whole = np.rint(numbers)
    if not ((whole >= -(2**31)) & (whole < 2**31)).all():
        raise InputError(path, "a coordinate is beyond what the file can hold", "Write .npz.")
    return whole.astype(np.int32)
