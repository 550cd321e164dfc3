"""Float32 rows without a header (`.bin`): KITTI, SemanticKITTI, WADS, REHEARSE-3D."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.columns import DEFAULT_COLUMNS, columns_of, name_columns, scan_of
from derain.files.reading import reading
from derain.scan import SENTINEL, Scan

# No LiDAR reports a negative intensity. Rows of 5 or 6 values read as rows of 4 put a coordinate
# where the intensity should be, and about half of those are negative: 16 to 38 % of all rows on
# real scans of six sensors. The few radar points of a fused scan, perhaps in dB, are far fewer.
LARGEST_NEGATIVE_SHARE = 0.1


def read_binary(path: Path, columns: Sequence[str] = DEFAULT_COLUMNS) -> Scan:
    """Reads float32 rows.

    Args:
        path: The file: little-endian float32, row-major, no header.
        columns: Names of the values of a row.

    Returns:
        The scan; an empty file is a scan of zero points.

    Raises:
        InputError: A file that cannot be read, that is not whole rows of these columns, or whose
            intensities show that it has other columns.
    """
    with reading(path):
        content = path.read_bytes()
    row = 4 * len(columns)
    if row == 0 or len(content) % row:
        raise InputError(
            path,
            f"{len(content)} bytes are not whole rows of {row} bytes ({','.join(columns)})",
            "Name the file's columns with --columns, e.g. --columns x,y,z,intensity,ring.",
        )
    table = np.frombuffer(content, "<f4").reshape(-1, len(columns))
    scan = scan_of(path, name_columns(path, table, columns))
    _check_intensity(path, scan)
    return scan


def _check_intensity(path: Path, scan: Scan) -> None:
    if scan.intensity is None:
        return
    finite = np.isfinite(scan.xyz).all(axis=1) & np.isfinite(scan.intensity)
    negative = finite & (scan.intensity < 0) & (scan.intensity != SENTINEL)
    if negative.sum() > LARGEST_NEGATIVE_SHARE * finite.sum():
        share = negative.sum() / finite.sum()
        raise InputError(
            path,
            f"{share:.0%} of the intensities are negative, as if it had more columns than stated",
            "Name every column, e.g. --columns x,y,z,intensity,ring; if the values are right and "
            "no intensities, call them something else.",
        )


def write_binary(path: Path, scan: Scan) -> None:
    """Writes a scan's columns as float32 rows.

    Raises:
        InputError: A column that float32 cannot hold exactly, or a file that cannot be written.
    """
    columns = columns_of(scan)
    table = np.empty((len(scan), len(columns)), "<f4")
    for place, (name, column) in enumerate(columns.items()):
        if column.ndim != 1 or not np.can_cast(column.dtype, np.float32):
            raise InputError(
                path,
                f"float32 cannot hold the column {name} ({column.dtype}) without loss",
                "Write .pcd or .npz.",
            )
        table[:, place] = column
    with replacing(path) as temporary:
        table.tofile(temporary)
