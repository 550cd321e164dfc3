"""Point clouds in NumPy's own files: one array (`.npy`) or several named ones (`.npz`)."""

import math
import zipfile
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.lib import format as npy_format
from numpy.typing import NDArray

from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.columns import DEFAULT_COLUMNS, columns_of, name_columns, records, scan_of
from derain.files.reading import reading
from derain.scan import Scan

# NumPy parses an array's header as Python code, and lets out whatever that raises on damaged bytes.
_DAMAGE = Exception


@dataclass(frozen=True)
class NpyHeader:
    """How a .npy file holds its columns: as named fields, or side by side without names."""

    structured: bool


@dataclass(frozen=True)
class NpzHeader:
    """Arrays of an .npz file that are not one value per point, e.g. the angles of the beams."""

    constants: Mapping[str, NDArray[Any]]


def read_npy(path: Path, columns: Sequence[str] = DEFAULT_COLUMNS) -> Scan:
    """Reads one array of points.

    Args:
        path: The file: numbers (N, C), or (H, W, C) of an organised cloud; or a structured array
            (N,) or (H, W).
        columns: Names of the C columns; a structured array has its own.

    Raises:
        InputError: A file that cannot be read, or an array of another shape.
    """
    with reading(path, _DAMAGE), path.open("rb") as file:
        array = npy_format.read_array(file, allow_pickle=False)
    names = array.dtype.names
    grid = array.shape if names else array.shape[:-1]
    shape = _organised(path, grid)
    if names:
        flat = array.reshape(-1)
        fields = {name: flat[name] for name in names}
    else:
        fields = name_columns(path, array.reshape(math.prod(grid), array.shape[-1]), columns)
    return scan_of(path, fields, shape, NpyHeader(structured=bool(names)))


def write_npy(path: Path, scan: Scan) -> None:
    """Writes a scan's columns as one array.

    Columns of one dtype become an array (N, C), unless the scan comes from a structured one;
    columns of several become a structured array. Organised clouds stay organised.

    Raises:
        InputError: The file cannot be written.
    """
    named = isinstance(scan.header, NpyHeader) and scan.header.structured
    columns = scan.fields if named else columns_of(scan)
    dtypes = {column.dtype for column in columns.values()}
    flat = all(column.ndim == 1 for column in columns.values())
    if len(dtypes) == 1 and flat and not named:
        array = np.stack(list(columns.values()), axis=1, dtype=dtypes.pop())
    else:
        row = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
        array = records(columns, np.dtype(row))
    with replacing(path) as temporary, temporary.open("wb") as file:
        npy_format.write_array(file, _gridded(scan, array), allow_pickle=False)


def read_npz(path: Path) -> Scan:
    """Reads named arrays.

    Args:
        path: The file. Coordinates are `xyz` (N, 3) or `x`, `y` and `z` (N,); in an organised
            cloud `xyz` (H, W, 3) or `x`, `y` and `z` (H, W). Every array that begins with the same
            (N,) or (H, W) is a column of the scan, flattened row-major. An array (W,) in an
            organised cloud, such as a spinning sensor's timestamps, is repeated for each of the H
            rows.

    Raises:
        InputError: A file that cannot be read, or that has no coordinates.
    """
    arrays: dict[str, NDArray[Any]] = {}
    with reading(path, _DAMAGE), zipfile.ZipFile(path) as archive:
        for member in archive.namelist():
            with archive.open(member) as file:
                arrays[member.removesuffix(".npy")] = npy_format.read_array(
                    file, allow_pickle=False
                )
    grid = _grid(path, arrays)
    shape = _organised(path, grid)
    fields, constants = {}, {}
    for name, array in arrays.items():
        if array.shape[: len(grid)] == grid:
            fields[name] = array.reshape(math.prod(grid), *array.shape[len(grid) :])
        elif shape and array.shape == shape[1:]:
            fields[name] = np.tile(array, shape[0])
        else:
            constants[name] = array
    return scan_of(path, fields, shape, NpzHeader(constants))


def write_npz(path: Path, scan: Scan) -> None:
    """Writes a scan's columns as named arrays, compressed. Organised clouds stay organised.

    Raises:
        InputError: The file cannot be written.
    """
    columns = scan.fields or columns_of(scan)
    arrays = {name: _gridded(scan, column) for name, column in columns.items()}
    if isinstance(scan.header, NpzHeader):
        arrays |= scan.header.constants
    # Not numpy.savez, which cannot write an array named "file".
    with (
        replacing(path) as temporary,
        zipfile.ZipFile(temporary, "w", zipfile.ZIP_DEFLATED) as archive,
    ):
        for name, array in arrays.items():
            with archive.open(f"{name}.npy", "w", force_zip64=True) as file:
                npy_format.write_array(file, array, allow_pickle=False)


def _grid(path: Path, arrays: Mapping[str, NDArray[Any]]) -> tuple[int, ...]:
    """Shape of the arrays that hold one value per point."""
    shapes = {name.lower(): array.shape for name, array in arrays.items()}
    if "xyz" in shapes:
        return shapes["xyz"][:-1]
    if "x" in shapes:
        return shapes["x"]
    raise InputError(
        path,
        f"has no coordinates among its arrays ({', '.join(arrays)})",
        "Name them xyz, or x, y and z.",
    )


def _organised(path: Path, grid: tuple[int, ...]) -> tuple[int, int] | None:
    """(height, width) if the points lie on a grid of two axes."""
    match grid:
        case (_,):
            return None
        case (height, width):
            return height, width
        case _:
            raise InputError(
                path,
                f"points lie in an array of {len(grid)} axes",
                "Give a list of points, or a grid of rows and columns.",
            )


def _gridded(scan: Scan, column: NDArray[Any]) -> NDArray[Any]:
    return column.reshape(*(scan.shape or (len(scan),)), *column.shape[1:])
