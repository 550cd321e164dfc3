"""Puts other points in place of a scan's own, in all the columns that its file has for them."""

from dataclasses import replace
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.files.columns import INTENSITY_NAMES
from derain.scan import Scan, to_float32

# What files call the distance of a point, in a unit of their own.
RANGE_NAMES = ("range", "distance")


def with_points(scan: Scan, rows: NDArray[np.int64], xyz: NDArray[np.float64]) -> Scan:
    """The scan with other coordinates in some rows.

    Columns of coordinates, and of range or distance in whatever unit, get the new values in their
    own dtype; every other row stays as it is, to the bit.

    Args:
        scan: The scan.
        rows: Row numbers, int64 (M,).
        xyz: Their coordinates, float64 (M, 3), metres in the sensor frame; NaN becomes 0 in columns
            of whole numbers.
    """
    named = {"xyz": xyz, "x": xyz[:, 0], "y": xyz[:, 1], "z": xyz[:, 2]}
    distance = np.linalg.norm(xyz, axis=1)
    fields = dict(scan.fields)
    for name, column in fields.items():
        if name.lower() in named:
            fields[name] = _written(column, rows, named[name.lower()])
        elif name.lower() in RANGE_NAMES:
            fields[name] = _written(column, rows, distance * _unit(column, scan))
    return replace(scan, xyz=_written(scan.xyz, rows, to_float32(xyz)), fields=fields)


def with_intensity(scan: Scan, rows: NDArray[np.int64], intensity: NDArray[np.float64]) -> Scan:
    """The scan with other intensities in some rows; every other row stays as it is, to the bit.

    Args:
        scan: A scan with intensities.
        rows: Row numbers, int64 (M,).
        intensity: Their intensities in the scan's unit, float64 (M,), rounded in a column of whole
            numbers.
    """
    assert scan.intensity is not None
    by_lower_case = {name.lower(): name for name in scan.fields}
    found = [by_lower_case[name] for name in INTENSITY_NAMES if name in by_lower_case][:1]
    fields = {name: _written(scan.fields[name], rows, intensity) for name in found}
    # The scan's intensity is what its file holds: rounded if that is a column of whole numbers.
    seen = [column[rows] for column in fields.values()] or [intensity]
    return replace(
        scan,
        intensity=_written(scan.intensity, rows, to_float32(seen[0])),
        fields={**scan.fields, **fields},
    )


def _unit(column: NDArray[Any], scan: Scan) -> float:
    """What a column of ranges holds for a metre."""
    valid = scan.valid
    return float(np.median(column[valid] / scan.range[valid])) if valid.any() else 1.0


def _written(column: NDArray[Any], rows: NDArray[np.int64], values: NDArray[Any]) -> NDArray[Any]:
    column = column.copy()
    if column.dtype.kind in "iu":
        limits = np.iinfo(column.dtype)
        values = np.clip(np.rint(np.nan_to_num(values)), limits.min, limits.max)
    column[rows] = values
    return column
