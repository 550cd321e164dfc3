"""Readers and writers of point clouds, chosen by the suffix of the file.

Every column of a file comes back in `Scan.fields`, in its own dtype, and is written as it was read:
`write_scan(path, scan.take(~rain))` is the file without its rain and otherwise the same.
"""

import warnings
from collections.abc import Iterable, Sequence
from pathlib import Path

from derain.errors import InputError, ScanWarning
from derain.files.atomic import replacing
from derain.files.columns import DEFAULT_COLUMNS
from derain.files.content import compressed, read_content
from derain.files.format import FORMATS, format_of
from derain.files.frame_times import METADATA
from derain.files.names import is_compressed, scan_suffix
from derain.files.reading import reading
from derain.scan import Array, Scan

__all__ = ["DEFAULT_COLUMNS", "count_points", "find_scans", "read_scan", "write_scan"]

# Files that lie in folders of scans and are no scans, though their suffix is one of a format: when
# the scans were taken, KITTI's poses, times and calibration, and what a person is to read.
RECORDS = (METADATA, "calib.txt", "poses.txt", "times.txt", "timestamps.txt", "README.txt")

# Suffixes of tables that are likely to be records of something else, such as of poses, the likelier
# the higher, with 0 for all other suffixes: of a folder's files, those of the lowest are its scans.
LIKELY_RECORDS = {".csv": 1, ".txt": 2}


def read_scan(path: Path | str, columns: Sequence[str] = DEFAULT_COLUMNS) -> Scan:
    """Reads one scan.

    Example:
        >>> scan = read_scan("scan.bin")
        >>> len(scan), list(scan.fields)
        (820, ['x', 'y', 'z', 'intensity'])

    Args:
        path: The file, in any of FORMATS; compressed as a whole if its name ends in .gz.
        columns: Names of the columns of a file that does not name them itself: .bin, .npy unless
            structured, .npz of one array, and text without a line of names.

    Returns:
        The scan, one point per row of the file, in its order. `xyz` and `intensity` (the first of
        intensity, i, reflectivity, remission and signal) are float32; `fields` has every column as
        it is in the file.

    Raises:
        InputError: A file that is missing, damaged, of an unknown format, or without coordinates;
            that is larger than any scan (derain.files.content), or needs more memory than there is.
    """
    path = Path(path)
    format_ = format_of(path)
    with reading(path, *format_.DAMAGE):
        return format_.decode(read_content(path), columns)


def count_points(path: Path, columns: Sequence[str] = DEFAULT_COLUMNS) -> int:
    """Number of points of a scan, which is read only where its file's size is not enough.

    Args:
        path: As for :func:`read_scan`.
        columns: As for :func:`read_scan`.

    Raises:
        InputError: A scan that cannot be read.
    """
    counted = None if is_compressed(path) else format_of(path).count(path, columns)
    return len(read_scan(path, columns)) if counted is None else counted


def write_scan(path: Path | str, scan: Scan | Array) -> None:
    """Writes one scan: every column of the file it came from, else coordinates and intensity.

    What the scan's file holds besides and cannot be written is warned of by ScanWarning.

    Example:
        >>> scan = read_scan("scan.bin")
        >>> write_scan("near.pcd", scan.take(scan.range < 15))
        >>> len(read_scan("near.pcd"))
        20

    Args:
        path: The file, in any of FORMATS; compressed as a whole if its name ends in .gz.
        scan: The scan, or an array of points as :meth:`derain.scan.Scan.of` takes it.

    Raises:
        InputError: No scan, an unknown format, a column that the format cannot hold, or a file that
            cannot be written.
    """
    path, scan = Path(path), Scan.of(scan)
    content = format_of(path).encode(path, scan)
    if scan.left_out:
        lack = f"the written copy of {scan.name} lacks its {', '.join(scan.left_out)}"
        warnings.warn(lack, ScanWarning, stacklevel=2)
    with replacing(path) as temporary:
        temporary.write_bytes(compressed(content) if is_compressed(path) else content)


def find_scans(paths: Iterable[Path | str]) -> list[Path]:
    """Lists the scans that a user names.

    Args:
        paths: Files, which are taken as they are, and folders, which stand for the scans directly
            in them, sorted by name. Passed over are hidden files, RECORDS, any .csv beside scans of
            other formats, and any .txt beside scans of other formats or .csv.

    Raises:
        InputError: A path that does not exist or may not be read, or a folder without scans.
    """
    scans: list[Path] = []
    for path in map(Path, paths):
        with reading(path):
            if path.is_dir():
                scans += _scans_in(path)
            elif path.exists():
                scans.append(path)
            else:
                raise InputError(path, "there is no such file or folder", "Check the path.")
    return scans


def _scans_in(folder: Path) -> list[Path]:
    scans = sorted(
        path
        for path in folder.iterdir()
        if scan_suffix(path) in FORMATS
        and path.name not in RECORDS
        and not path.name.startswith(".")
        and path.is_file()
    )
    likely = {path: LIKELY_RECORDS.get(scan_suffix(path), 0) for path in scans}
    least = min(likely.values(), default=0)
    scans = [path for path in scans if likely[path] == least]
    if not scans:
        reason = f"holds no scans ({', '.join(FORMATS)})"
        raise InputError(folder, reason, "Name a folder with scans in it.")
    return scans
