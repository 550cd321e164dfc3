"""Rows of numbers without a header (`.bin`): KITTI, SemanticKITTI, WADS, REHEARSE-3D."""

from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.columns import INTENSITY_NAMES, columns_of, name_columns, scan_of
from derain.files.content import Content
from derain.files.format import FORMATS, Format
from derain.files.reading import file_size, reading
from derain.scan import LARGEST_COORDINATE, LARGEST_VALUE, SENTINEL, Scan

# No LiDAR reports a negative intensity. Rows of 5 or 6 values read as rows of 4 put a coordinate
# where the intensity should be, and about half of those are negative: 16 to 38 % of all rows on
# real scans of six sensors. The few radar points of a fused scan, perhaps in dB, are far fewer.
LARGEST_NEGATIVE_SHARE = 0.1

# Whether a file is float64 or float32 follows from its numbers: read as the other type, many are
# beyond any sensor's reach, or nearer to 0 than anyone measures. HEAD: bytes of the file that are
# examined. FEWEST_ROWS: fewer rows prove nothing. SMALLEST_VALUE: no sensor measures values nearer
# to 0. LARGEST_ODD_SHARE: a larger share of rows with such numbers is no chance.
HEAD = 2**16
FEWEST_ROWS = 8
SMALLEST_VALUE = 1e-12
LARGEST_ODD_SHARE = 0.1


@dataclass(frozen=True)
class BinaryHeader:
    """The type of a file's numbers, "<f4" or "<f8", which the file itself does not state."""

    value: str = "<f4"


@FORMATS.add(".bin")
class Binary(Format):
    """Rows of numbers, little-endian and row-major, without a header."""

    HELP = "rows of float32 or float64 without a header: KITTI and many others"
    NAMES_COLUMNS = False

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads rows of numbers.

        Args:
            content: The file: little-endian, row-major, no header. It is float32, unless its
                numbers make no sense as that and good sense as float64.
            columns: Names of the values of a row.

        Returns:
            The scan; an empty file is a scan of zero points.

        Raises:
            InputError: A file that is not whole rows of these columns, or whose intensities show
                that it has other columns.
        """
        value = _value_type(content.data[:HEAD], len(content.data), columns)
        row = np.dtype(value).itemsize * len(columns)
        if row == 0 or len(content.data) % row:
            raise InputError(
                content.path,
                f"{len(content.data)} bytes are not whole rows of {row} bytes "
                f"({','.join(columns)})",
                "Name the file's columns with --columns, e.g. --columns x,y,z,intensity,ring.",
            )
        table = np.frombuffer(content.data, value).reshape(-1, len(columns))
        fields = name_columns(content.path, list(table.T), columns)
        scan = scan_of(content.path, fields, header=BinaryHeader(value))
        _check_intensity(content.path, scan)
        return scan

    def count(self, path: Path, columns: Sequence[str]) -> int | None:
        """Number of points of a file; only its beginning is read.

        Args:
            path: The file.
            columns: Names of the values of a row.

        Returns:
            The number; None if the file is not whole rows.

        Raises:
            InputError: A file that cannot be read.
        """
        with reading(path):
            size = file_size(path)
            with path.open("rb") as file:
                head = file.read(HEAD)
        row = np.dtype(_value_type(head, size, columns)).itemsize * len(columns)
        rows, rest = divmod(size, row)
        return None if rest else rows

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as rows of float32, or of float64 if the scan comes from such a file.

        Raises:
            InputError: A column that these cannot hold exactly.
        """
        columns = columns_of(scan)
        header = scan.header if isinstance(scan.header, BinaryHeader) else BinaryHeader()
        table = np.empty((len(scan), len(columns)), header.value)
        for place, (name, column) in enumerate(columns.items()):
            if column.ndim != 1 or not np.can_cast(column.dtype, table.dtype):
                raise InputError(
                    path,
                    f"{table.dtype} cannot hold the column {name} ({column.dtype}) without loss",
                    "Write .pcd or .npz.",
                )
            table[:, place] = column
        return table.tobytes()


def _value_type(head: bytes, size: int, columns: Sequence[str]) -> str:
    """Type of the numbers of a file: "<f8" or "<f4".

    Args:
        head: The first HEAD bytes of the file.
        size: Bytes of the whole file.
        columns: Names of the values of a row.
    """
    row = 8 * len(columns)
    if row == 0 or size % row or len(head) < FEWEST_ROWS * row:
        return "<f4"
    head = head[: len(head) // row * row]
    single, double = _odd_share(head, "<f4", columns), _odd_share(head, "<f8", columns)
    return "<f8" if double == 0 and single > LARGEST_ODD_SHARE else "<f4"


def _odd_share(head: bytes, value: str, columns: Sequence[str]) -> float:
    """Share of the rows with a number that no scan holds; NaN and infinity are in many."""
    table = np.frombuffer(head, value).reshape(-1, len(columns))
    size, reach = np.abs(table), np.array([_reach(name) for name in columns])
    odd = np.isfinite(size) & (size > reach) | (size > 0) & (size < SMALLEST_VALUE)
    intensity = table[:, [name.lower() in INTENSITY_NAMES for name in columns]]
    negative = (intensity < 0) & (intensity != SENTINEL)
    return float((odd.any(axis=1) | negative.any(axis=1)).mean())


def _reach(name: str) -> float:
    """A bound that no number of a column exceeds."""
    if name.lower() in ("x", "y", "z"):
        return LARGEST_COORDINATE
    return LARGEST_VALUE if name.lower() in INTENSITY_NAMES else np.inf


def _check_intensity(path: Path, scan: Scan) -> None:
    if scan.intensity is None:
        return
    negative = (scan.intensity < 0) & (scan.intensity != SENTINEL)
    if not negative.any():
        return
    finite = np.isfinite(scan.xyz).all(axis=1) & np.isfinite(scan.intensity)
    negative &= finite
    if negative.sum() > LARGEST_NEGATIVE_SHARE * finite.sum():
        share = negative.sum() / finite.sum()
        raise InputError(
            path,
            f"{share:.0%} of the intensities are negative, as if it had more columns than stated",
            "Name every column, e.g. --columns x,y,z,intensity,ring; if the values are right and "
            "no intensities, call them something else.",
        )
