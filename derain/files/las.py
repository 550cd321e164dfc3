"""Point clouds of laser surveys (`.las`, compressed `.laz`), read and written by laspy.

Source: ASPRS, "LAS Specification", version 1.4 R15.
"""

import io
import struct
from dataclasses import dataclass
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.columns import columns_of, scan_of
from derain.files.content import Content
from derain.files.extras import import_extra
from derain.files.names import scan_suffix
from derain.files.reading import reading
from derain.scan import LARGEST_COORDINATE, Scan

# Sizes of the fixed part of a variable-length record, and of an extended one.
_RECORD, _EXTENDED_RECORD = 54, 60

# Beyond this from the file's offset, float32 would lose more than a few millimetres.
_FAR = 1e5

# No survey is finer than this, in metres.
_FINEST_SCALE = 1e-12


@dataclass(frozen=True, eq=False)
class LasHeader:
    """What a LAS file says besides its points.

    Attributes:
        header: laspy's.
        origin: Whole numbers that stand for the origin of the scan's coordinates, int64 (3,).
    """

    header: Any
    origin: NDArray[np.int64]


def decode_las(content: Content) -> Scan:
    """Reads a LAS or LAZ file.

    Surveys have coordinates of millions of metres, which float32 holds to decimetres. The scan's
    coordinates are therefore relative to the offset that the file states, or, where they would
    still be farther than 100 km from it, to their median.

    Args:
        content: The file, version 1.0 to 1.4.

    Returns:
        The scan: x, y and z are float64, metres; every other column is as the file stores it, so
        that a column may hold several values in its bits.

    Raises:
        InputError: A file that is damaged, or laspy is not installed.
    """
    laspy = import_extra("laspy", "las", content.path)
    with reading(content.path, Exception):
        header, raw = _points(laspy, content)
        whole = np.stack([raw[axis] for axis in "XYZ"], axis=1).astype(np.int64)
        origin = _origin(whole, header.scales)
        near = (whole - origin) * header.scales
    fields = {axis: near[:, place] for place, axis in enumerate("xyz")}
    fields |= {name: raw[name] for name in raw.dtype.names if name not in ("X", "Y", "Z")}
    return scan_of(content.path, fields, header=LasHeader(header, origin))


def encode_las(path: Path, scan: Scan) -> bytes:
    """A scan's columns as the points of the LAS file that it came from.

    Raises:
        InputError: A scan of another format, columns that its points have no place for, or
            coordinates beyond its reach; laspy is not installed.
    """
    laspy = import_extra("laspy", "las", path)
    columns = columns_of(scan)
    if not isinstance(scan.header, LasHeader):
        raise _refused(path)
    header, origin = scan.header.header, scan.header.origin
    points = laspy.ScaleAwarePointRecord.zeros(len(scan), header=header)
    stored = points.array.dtype.names
    if columns.keys() != {name.lower() if name in ("X", "Y", "Z") else name for name in stored}:
        raise _refused(path)
    for name, column in columns.items():
        if name in ("x", "y", "z"):
            place = "xyz".index(name)
            numbers = column / header.scales[place] + origin[place]
            points.array[name.upper()] = _stored(path, numbers)
        else:
            points.array[name] = column
    las = laspy.LasData(header.copy(), points)
    file = io.BytesIO()
    las.write(file, do_compress=scan_suffix(path) == ".laz", laz_backend=laspy.LazBackend.Lazrs)
    return file.getvalue()


def _refused(path: Path) -> InputError:
    return InputError(
        path, f"only what was read from a {scan_suffix(path)} can be written as one", "Write .npz."
    )


def _points(laspy: ModuleType, content: Content) -> tuple[Any, NDArray[Any]]:
    """Laspy's header of a file, and the file's points as they are stored, structured (N,)."""
    _check_counts(content)
    # One thread, so that what is written does not depend on the machine either.
    with laspy.open(io.BytesIO(content.data), laz_backend=laspy.LazBackend.Lazrs) as file:
        header = file.header
        _check_compression(content, header)
        raw = file.read().points.array
    if {"x", "y", "z"} & set(raw.dtype.names):
        raise ValueError("a further column is called x, y or z")
    if len(raw) < header.point_count:
        raise ValueError(f"{len(raw)} points where the header states {header.point_count}")
    return header, raw


def _check_counts(content: Content) -> None:
    """Refuses a header that states more records or points than the file can hold."""
    data = content.data
    if len(data) < 227 or data[:4] != b"LASF":
        raise ValueError("no LAS header")
    (records,), extended = struct.unpack_from("<I", data, 100), 0
    size, points = struct.unpack_from("<HI", data, 105)
    if data[25] >= 4 and len(data) >= 375:  # the minor version
        extended, points = struct.unpack_from("<IQ", data, 243)
    if records * _RECORD + extended * _EXTENDED_RECORD > len(data):
        raise ValueError(f"{records + extended:,} records in the header")
    content.room.take(points * size)


def _check_compression(content: Content, header: Any) -> None:
    """Refuses compressed points that are not of the header's size."""
    if header.are_points_compressed:
        lazrs = import_extra("lazrs", "las", content.path)
        (record,) = header.vlrs.get("LasZipVlr")
        if lazrs.LazVlr(record.record_data).item_size() != header.point_format.size:
            raise ValueError("compressed points of another size than the header's")


def _origin(whole: NDArray[np.int64], scales: NDArray[np.float64]) -> NDArray[np.int64]:
    """What the coordinates of the scan are relative to."""
    if not ((scales > _FINEST_SCALE) & (scales < LARGEST_COORDINATE)).all():
        raise ValueError(f"the scales of the coordinates are {scales}")
    if not len(whole):
        return np.zeros(3, np.int64)
    median = np.median(whole, axis=0).astype(np.int64)
    return np.where(np.abs(median * scales) > _FAR, median, 0)


def _stored(path: Path, numbers: NDArray[np.float64]) -> NDArray[np.int32]:
    """Coordinates as LAS stores them."""
    whole = np.rint(numbers)
    if not ((whole >= -(2**31)) & (whole < 2**31)).all():
        raise InputError(path, "a coordinate is beyond what the file can hold", "Write .npz.")
    return whole.astype(np.int32)
