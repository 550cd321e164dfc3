"""Named columns: what every scan file holds, and the Scan they make."""

from collections.abc import Collection, Iterable, Mapping, Sequence
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np

from derain.errors import InputError
from derain.files.names import scan_suffix
from derain.files.text import encode
from derain.scan import Array, Float32s, Scan, flattened, named, to_float32

# Columns of a file by their names, N rows each.
Columns = Mapping[str, Array]

# KITTI, SemanticKITTI, WADS and REHEARSE-3D.
DEFAULT_COLUMNS = ("x", "y", "z", "intensity")

# What files call the strength of a return; the first that is present counts.
INTENSITY_NAMES = ("intensity", "i", "intensities", "reflectivity", "remission", "signal")


def name_columns(path: Path, columns: Sequence[Array], names: Sequence[str]) -> dict[str, Array]:
    """Gives the columns of a file without names the names stated by the user.

    Args:
        path: The file, for messages.
        columns: C columns (N,).
        names: C names.

    Returns:
        Name → column, in the same order.

    Raises:
        InputError: Another number of names than columns, or a name given twice.
    """
    stated = ",".join(names)
    if len(columns) != len(names):
        reason = f"has {len(columns)} columns, but {len(names)} are stated ({stated})"
        remedy = "Name every column of the file with --columns, x, y and z among them."
        raise InputError(path, reason, remedy)
    if len(set(names)) < len(names):
        raise InputError("--columns", f"a name comes twice in {stated}", "Name each column once.")
    return dict(zip(names, columns, strict=True))


def scan_of(
    path: Path, fields: Columns, shape: tuple[int, int] | None = None, header: object = None
) -> Scan:
    """Makes a Scan of a file's columns.

    Args:
        path: The file.
        fields: Name → column, each of N rows: either `x`, `y` and `z` (N,) or `xyz` (N, 3), metres
            in the sensor frame; `intensity` (or another of INTENSITY_NAMES) and `radar` (not 0 for
            points of the radar) if the file has them; and all its other columns. A name in another
            case counts if no column has exactly this one.
        shape: (height, width) of an organised cloud.
        header: The content of the file besides its columns, for the writer of its format.

    Raises:
        InputError: No coordinates, coordinates that are not numbers, or several columns that match
            one name: see :func:`derain.scan.named`.
    """
    flat = _numbers(fields, 1, kinds="biuf")
    intensity = intensity_name(path, flat)
    radar = named(flat, "radar", path)
    return Scan(
        _coordinates(path, fields),
        None if intensity is None else to_float32(flat[intensity]),
        radar=None if radar is None else radar != 0,
        fields=dict(fields),
        shape=shape,
        name=str(path),
        header=header,
    )


def intensity_name(subject: str | Path, names: Iterable[str]) -> str | None:
    """The column that holds the intensity, the first of INTENSITY_NAMES; None if there is none.

    Args:
        subject: Name of the file in messages.
        names: Names of its columns.

    Raises:
        InputError: Several columns match one name: see :func:`derain.scan.named`.
    """
    known = {name: name for name in names}
    found = (named(known, name, subject) for name in INTENSITY_NAMES)
    return next((name for name in found if name is not None), None)


def _numbers(fields: Columns, *axes: int, kinds: str = "iuf") -> dict[str, Array]:
    """The columns that hold numbers and have one of these numbers of axes, once flattened."""
    columns = {name: flattened(column) for name, column in fields.items()}
    return {
        name: column
        for name, column in columns.items()
        if column.dtype.kind in kinds and column.ndim in axes
    }


def _coordinates(path: Path, fields: Columns) -> Float32s:
    """Coordinates among a file's columns, float32 (N, 3)."""
    table = named(_numbers(fields, 1, 2), "xyz", path)
    if table is not None:
        return to_float32(table)
    flat = _numbers(fields, 1)
    axes = [column for axis in "xyz" if (column := named(flat, axis, path)) is not None]
    if len(axes) < 3:
        columns = ", ".join(f"{name} {_kind(column)}" for name, column in fields.items())
        raise InputError(
            path,
            f"has no x, y and z of one number per point among its columns ({columns})",
            "Name the coordinates x, y and z; --columns names the columns of a file without names.",
        )
    return np.stack([to_float32(axis) for axis in axes], axis=1)


def _kind(column: Array) -> str:
    """Type of a column's values, and their shape at each point."""
    return f"{column.dtype}{f' of shape {column.shape[1:]}' if column.ndim > 1 else ''}"


def columns_of(scan: Scan) -> dict[str, Array]:
    """The columns of a scan in a file.

    Returns:
        Name → column of N rows: the columns of the scan's own file, or x, y, z (and intensity) of a
        scan made in memory. Coordinates held in one `xyz` array come out as x, y and z, and columns
        (N, 1) as (N,), which every format can hold.
    """
    from_memory = {"xyz": scan.xyz, "intensity": scan.intensity}
    columns: dict[str, Array] = {}
    for name, column in (scan.fields or from_memory).items():
        if name == "xyz" and column is not None:
            columns |= {axis: column[:, place] for place, axis in enumerate("xyz")}
        elif column is not None:
            columns[name] = flattened(column)
    return columns


def with_column(scan: Scan, name: str, column: Array) -> Scan:
    """The same scan with a further column in its file; one that has this name is replaced.

    Args:
        scan: The scan, whether or not it came from a file.
        name: Name of the column.
        column: Its values, (N,).

    Raises:
        InputError: A column of another length.
    """
    return replace(scan, fields={**(scan.fields or columns_of(scan)), name: column})


def describable_columns(path: Path, scan: Scan, types: Collection[str]) -> dict[str, Array]:
    """The columns of a scan for a format whose header describes each in a line of text.

    Args:
        path: The file, for messages.
        scan: The scan.
        types: Types of the format in NumPy's spelling, such as "f4".

    Returns:
        Columns as `columns_of` gives them, truth values as uint8.

    Raises:
        InputError: A column of a type that the format does not have, of a name that is not one
            word, or without a value.
    """
    columns = {
        name: column.astype(np.uint8) if column.dtype == bool else column
        for name, column in columns_of(scan).items()
    }
    for name, column in columns.items():
        one_word = encode(name).split() == [encode(name)]
        if not one_word or column.dtype.str[1:] not in types or 0 in column.shape[1:]:
            raise no_place(path, name, column)
    return columns


def no_place(path: Path, name: str, column: Array, remedy: str = "Write .npz.") -> InputError:
    """The error of a column that a format cannot hold."""
    reason = f"{scan_suffix(path)} has no place for the column '{name}' ({_kind(column)})"
    return InputError(path, reason, remedy)


def records(columns: Columns, row: np.dtype[Any]) -> Array:
    """Columns of N rows each as one structured array (N,).

    Args:
        columns: The columns.
        row: Dtype of the array, with a field for each column in the same order.
    """
    table = np.empty(len(next(iter(columns.values()))), row)
    for field, column in zip(row.names or (), columns.values(), strict=True):
        table[field] = column
    return table
