"""Point clouds in NumPy's own files: one array (`.npy`) or several named ones (`.npz`)."""

import io
import math
import zipfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.lib import format as npy_format

from derain.errors import InputError
from derain.files.columns import Columns, columns_of, intensity_name, name_columns, records, scan_of
from derain.files.content import Content, check_columns
from derain.files.format import FORMATS, Format
from derain.scan import Array, Scan, has_points_as_columns, named

# What stands before each member in the directory of a ZIP file.
_MEMBER = b"PK\x01\x02"


@dataclass(frozen=True)
class NumpyHeader:
    """The layout of the columns of a .npy or .npz file.

    Attributes:
        constants: Arrays that are not one value per point, e.g. the angles of the beams.
        table: Name of the array of an .npz that holds several columns, if there is one.
        columns: Their names.
        structured: True if they are named fields of that array, or of that of a .npy.
    """

    constants: Columns
    table: str | None = None
    columns: tuple[str, ...] = ()
    structured: bool = False


@FORMATS.add(".npy")
class Npy(Format):
    """One array of NumPy's."""

    HELP = "one NumPy array"
    DAMAGE = (Exception,)  # NumPy parses an array's header as Python code
    NAMES_COLUMNS = False

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads one array of points.

        Args:
            content: The file: numbers (N, C), or (H, W, C) of an organised cloud; or a structured
                array (N,) or (H, W).
            columns: Names of the C columns; a structured array has its own.

        Raises:
            InputError: A file that is damaged, or an array of another shape.
        """
        array = _array(content.data)
        shape = _organised(content.path, _grid_of_table(array))
        fields = _columns_of_table(content.path, array, columns)
        header = NumpyHeader({}, structured=bool(array.dtype.names))
        return scan_of(content.path, fields, shape, header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as one array.

        Columns of one dtype become an array (N, C), unless the scan comes from a structured one;
        columns of several become a structured array. Organised clouds stay organised.
        """
        structured = isinstance(scan.header, NumpyHeader) and scan.header.structured
        columns = scan.fields if structured else columns_of(scan)
        return _to_bytes(_gridded(scan, _table(columns, structured)))


@FORMATS.add(".npz")
class Npz(Format):
    """Several arrays of NumPy's, each under its name."""

    HELP = "several NumPy arrays, by name"
    DAMAGE = (Exception,)

    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Reads named arrays.

        Args:
            content: The file. Coordinates are `xyz` (N, 3) or `x`, `y` and `z` (N,); in an
                organised cloud `xyz` (H, W, 3) or `x`, `y` and `z` (H, W). Without them, `points`
                or the only array is a table as in a .npy. Every array that begins with the same
                (N,) or (H, W) is a column of the scan, flattened row-major. An array (W,) in an
                organised cloud, such as a spinning sensor's timestamps, is repeated for each of the
                H rows.
            columns: Names of the columns of such a table, unless it is structured.

        Raises:
            InputError: A file that is damaged or has no coordinates, or an array that is named as
                coordinates, intensity or radar and has another number of points.
        """
        path, arrays = content.path, _arrays(content)
        table = _name_of_table(path, arrays)
        grid = _grid(path, arrays) if table is None else _grid_of_table(arrays[table])
        shape = _organised(path, grid)
        fields, constants, structured = dict[str, Array](), {}, False
        if table is not None:
            structured = bool(arrays[table].dtype.names)
            fields = _columns_of_table(path, arrays.pop(table), columns)
        stated = tuple(fields)
        for name, array in arrays.items():
            if name in stated:
                raise InputError(path, f"has an array {name} beside a column {name}", "Rename one.")
            if array.shape[: len(grid)] == grid:
                fields[name] = array.reshape(math.prod(grid), *array.shape[len(grid) :])
            elif shape and array.shape == shape[1:]:
                content.budget.reserve(shape[0] * array.nbytes)
                fields[name] = np.tile(array, shape[0])
            else:
                constants[name] = array
        _refuse_other_points(path, grid, fields, constants)
        header = NumpyHeader(constants, table, stated, structured)
        return scan_of(path, fields, shape, header)

    def encode(self, path: Path, scan: Scan) -> bytes:
        """A scan's columns as named arrays, compressed. Organised clouds stay organised."""
        header = scan.header if isinstance(scan.header, NumpyHeader) else NumpyHeader({})
        columns = dict(scan.fields or columns_of(scan))
        arrays: dict[str, Array] = {}
        if header.table is not None and columns.keys() >= set(header.columns):
            table = {name: columns.pop(name) for name in header.columns}
            arrays[header.table] = _gridded(scan, _table(table, header.structured))
        for name, column in columns.items():
            arrays[name] = _gridded(scan, column)
        arrays |= header.constants
        file = io.BytesIO()
        # Not numpy.savez, which cannot write an array named "file".
        with zipfile.ZipFile(file, "w", zipfile.ZIP_DEFLATED) as archive:
            for name, array in arrays.items():
                with archive.open(f"{name}.npy", "w", force_zip64=True) as member:
                    member.write(_to_bytes(array))
        return file.getvalue()


def _array(data: bytes) -> Array:
    """The array of a .npy file, if the file is as long as its header states."""
    file = io.BytesIO(data)
    # The third version differs from the second in the encoding of names alone.
    first = npy_format.read_magic(file) == (1, 0)
    read_header = npy_format.read_array_header_1_0 if first else npy_format.read_array_header_2_0
    shape, _, dtype = read_header(file)
    size = math.prod(shape) * dtype.itemsize
    if size > len(data) - file.tell() and not dtype.hasobject:
        raise ValueError(f"{size:,} bytes in the header, {len(data) - file.tell():,} behind it")
    file.seek(0)
    return npy_format.read_array(file, allow_pickle=False)


def _to_bytes(array: Array) -> bytes:
    """The array as a .npy file."""
    file = io.BytesIO()
    npy_format.write_array(file, array, allow_pickle=False)
    return file.getvalue()


def _arrays(content: Content) -> dict[str, Array]:
    """The arrays of an .npz file by their names."""
    check_columns(content.data.count(_MEMBER))
    arrays = {}
    with zipfile.ZipFile(io.BytesIO(content.data)) as archive:
        for member in archive.infolist():
            if member.compress_type not in (zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED):
                reason = "is compressed by a method that NumPy does not use"
                raise ValueError(f"{member.filename} {reason}")
            content.budget.reserve(member.file_size)
            with archive.open(member) as file:
                # So many bytes, not all: what a member states is not what it may expand to.
                data = file.read(member.file_size)
            arrays[member.filename.removesuffix(".npy")] = _array(data)
    return arrays


def _table(columns: Columns, structured: bool) -> Array:
    """Columns as one array: numbers (N, C) if all are of one dtype, else structured (N,)."""
    dtypes = {column.dtype for column in columns.values()}
    flat = all(column.ndim == 1 for column in columns.values())
    if len(dtypes) == 1 and flat and not structured:
        return np.stack(list(columns.values()), axis=1, dtype=dtypes.pop())
    row = [(name, column.dtype, column.shape[1:]) for name, column in columns.items()]
    return records(columns, np.dtype(row))


def _columns_of_table(path: Path, array: Array, columns: Sequence[str]) -> dict[str, Array]:
    """The columns of an array of numbers or a structured one, (N,); fields of more axes keep them.

    Raises:
        InputError: Another number of columns than names, or points that lie side by side.
        ValueError: More columns than a scan has.
    """
    if names := array.dtype.names:
        flat = array.reshape(-1)
        return {name: flat[name] for name in names}
    points = math.prod(array.shape[:-1])
    if has_points_as_columns(points, array.shape[-1]):
        remedy = "Write the array with a row for each point, such as its transpose."
        raise InputError(path, f"its array has shape {array.shape}", remedy)
    check_columns(array.shape[-1])  # before an array is made of each
    return name_columns(path, list(array.reshape(points, array.shape[-1]).T), columns)


def _name_of_table(path: Path, arrays: Columns) -> str | None:
    """Name of the array that holds all columns; None where each column has its own."""
    names = {name: name for name in arrays}
    if named(names, "xyz", path) or named(names, "x", path):
        return None
    return named(names, "points", path) or (next(iter(arrays)) if len(arrays) == 1 else None)


def _grid_of_table(array: Array) -> tuple[int, ...]:
    return array.shape if array.dtype.names else array.shape[:-1]


def _grid(path: Path, arrays: Columns) -> tuple[int, ...]:
    """Shape of the arrays that hold one value per point."""
    table, column = named(arrays, "xyz", path), named(arrays, "x", path)
    if table is not None:
        return table.shape[:-1]
    if column is not None:
        return column.shape[:1] if column.shape[1:] == (1,) else column.shape
    reason = f"has no coordinates among its arrays ({', '.join(arrays)})"
    raise InputError(path, reason, "Name them xyz, or x, y and z.")


def _refuse_other_points(
    path: Path, grid: tuple[int, ...], fields: Columns, constants: Columns
) -> None:
    """Refuses a constant that has the name of a column that is read.

    A single value, such as the number of a frame under the name i, is no column of anything.
    """
    arrays = {name for name, array in constants.items() if array.ndim}
    known = {name: name for name in (*fields, *arrays)}
    axes = "xyz" if named(known, "xyz", path) is None else ("xyz",)
    read = [named(known, name, path) for name in (*axes, "radar")]
    for name in (*read, intensity_name(path, known)):
        if name in arrays:
            shape = constants[name].shape
            reason = f"the array {name} has shape {shape}, but the points have {grid}"
            raise InputError(path, reason, f"Give {name} one value per point, or another name.")


def _organised(path: Path, grid: tuple[int, ...]) -> tuple[int, int] | None:
    """(height, width) if the points lie on a grid of two axes."""
    if len(grid) not in (1, 2):
        reason = f"points lie in an array of {len(grid)} axes"
        raise InputError(path, reason, "Give a list of points, or a grid of rows and columns.")
    return (grid[0], grid[1]) if len(grid) == 2 else None


def _gridded(scan: Scan, column: Array) -> Array:
    return column.reshape(*(scan.shape or (len(scan),)), *column.shape[1:])
