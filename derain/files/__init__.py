"""Readers and writers of point clouds, chosen by the suffix of the file.

Every column of a file comes back in `Scan.fields`, in its own dtype, and is written as it was read:
`write_scan(path, scan.take(~rain))` is the file without its rain and otherwise the same.
"""

from collections.abc import Callable, Iterable, Sequence
from pathlib import Path

from derain.errors import InputError
from derain.files.binary import read_binary, write_binary
from derain.files.columns import DEFAULT_COLUMNS
from derain.files.csv_table import read_csv, write_csv
from derain.files.frame_times import METADATA
from derain.files.numpy_arrays import read_npy, read_npz, write_npy, write_npz
from derain.files.pcd import read_pcd, write_pcd
from derain.files.ply import read_ply, write_ply
from derain.files.reading import reading
from derain.scan import Scan

__all__ = ["DEFAULT_COLUMNS", "find_scans", "read_scan", "write_scan"]

# Files that leave the names of their columns to the user, and files that have them.
_STATED: dict[str, Callable[[Path, Sequence[str]], Scan]] = {".bin": read_binary, ".npy": read_npy}
_NAMED: dict[str, Callable[[Path], Scan]] = {
    ".npz": read_npz,
    ".pcd": read_pcd,
    ".ply": read_ply,
    ".csv": read_csv,
}
_WRITERS: dict[str, Callable[[Path, Scan], None]] = {
    ".bin": write_binary,
    ".npy": write_npy,
    ".npz": write_npz,
    ".pcd": write_pcd,
    ".ply": write_ply,
    ".csv": write_csv,
}


def read_scan(path: Path | str, columns: Sequence[str] = DEFAULT_COLUMNS) -> Scan:
    """Reads one scan.

    Args:
        path: The file: .bin, .npy, .npz, .pcd, .ply or .csv.
        columns: Names of the columns of a file that does not name them itself (.bin, and .npy
            unless structured).

    Returns:
        The scan, one point per row of the file, in its order. `xyz` and `intensity` (the first of
        intensity, i, reflectivity, remission and signal) are float32; `fields` has every column as
        it is in the file.

    Raises:
        InputError: A file that is missing, damaged, of an unknown format, or without coordinates.
    """
    path = Path(path)
    suffix = _known_suffix(path)
    return _STATED[suffix](path, columns) if suffix in _STATED else _NAMED[suffix](path)


def write_scan(path: Path | str, scan: Scan) -> None:
    """Writes one scan: every column of the file it came from, else coordinates and intensity.

    Args:
        path: The file: .bin, .npy, .npz, .pcd, .ply or .csv.
        scan: The scan.

    Raises:
        InputError: An unknown format, a column that the format cannot hold, or a file that cannot
            be written.
    """
    path = Path(path)
    _WRITERS[_known_suffix(path)](path, scan)


def find_scans(paths: Iterable[Path | str]) -> list[Path]:
    """Lists the scans that a user names.

    Args:
        paths: Files, which are taken as they are, and folders, which stand for the scans directly
            in them, sorted by name. Passed over are hidden files, metadata.csv, which says when
            scans were taken, and any .csv beside scans of other formats.

    Raises:
        InputError: A path that does not exist or may not be read, or a folder without scans.
    """
    scans: list[Path] = []
    for path in map(Path, paths):
        with reading(path):
            scans += _scans_in(path) if path.is_dir() else [_existing(path)]
    return scans


def _scans_in(folder: Path) -> list[Path]:
    scans = sorted(
        path
        for path in folder.iterdir()
        if path.suffix.lower() in _WRITERS
        and path.name != METADATA
        and not path.name.startswith(".")
        and path.is_file()
    )
    # Beside scans of other formats a table is a record of something else, such as of poses.
    scans = [path for path in scans if path.suffix.lower() != ".csv"] or scans
    if not scans:
        raise InputError(
            folder, f"holds no scans ({', '.join(_WRITERS)})", "Name a folder with scans in it."
        )
    return scans


def _existing(path: Path) -> Path:
    if not path.exists():
        raise InputError(path, "there is no such file or folder", "Check the path.")
    return path


def _known_suffix(path: Path) -> str:
    suffix = path.suffix.lower()
    if suffix not in _WRITERS:
        raise InputError(
            path, f"'{suffix}' is not the suffix of a scan", f"Known are {', '.join(_WRITERS)}."
        )
    return suffix
