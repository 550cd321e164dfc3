"""Returns by a file's own columns: which is the first of its ray, and which follow."""

from dataclasses import dataclass

import numpy as np

from derain.files.columns import Columns
from derain.scan import LARGEST_COORDINATE, Array, Bools, Ints, Scan

# Returns nearer to each other than this are of one surface, metres: the sensor split its echo.
# Source: tier4/nebula, `dual_return_distance_threshold`.
LEAST_APART = 0.1

# Drivers' names for the number of a return within its ray, and for the number of its returns.
NUMBER_NAMES = ("return_number", "return_id", "return_index", "echo")
COUNT_NAMES = ("number_of_returns", "return_count", "num_returns")

# Types of returns in dual mode, those in front and those behind: first or last of the two, each
# either the weaker or the stronger one. There are two numberings, which these pairs distinguish.
# Source: tier4/nebula, `ReturnType`; autowarefoundation/autoware.universe, `ReturnType`.
NEBULA = ((4, 9), (5, 10))
NEBULA_TELLS = frozenset({9, 10})
AUTOWARE = ((3, 5), (4, 6))
AUTOWARE_LARGEST = 7


@dataclass(frozen=True, eq=False)
class StatedReturns:
    """The returns of a scan by one or two of its columns.

    Attributes:
        column: Name of the column.
        number: Number of the return within its ray, int64 (N,); two returns of one ray have
            different numbers. -1 for the only return of a ray.
        nearer: True if a return of the same ray lies behind by the column, bool (N,).
        farther: True if a return of the same ray lies in front by the column, bool (N,).
    """

    column: str
    number: Ints
    nearer: Bools
    farther: Bools


def stated_returns(scan: Scan) -> StatedReturns | None:
    """Reads the returns of a scan from its columns.

    A column by which no ray has two returns is ignored: writers fill in 1 for unknown values.

    Args:
        scan: The scan. Supported columns: ``return_number`` (or ``return_id``, ``return_index``,
            ``echo``) with or without ``number_of_returns``, counted from the sensor outwards;
            ``bit_fields``, in which LAS has both; ``return_type`` of Nebula and Autoware; bits 4
            and 5 of Livox's ``tag``; and ``range2`` beside ``range``, by which Ouster states a
            second return in the row of the first.

    Returns:
        None if no column holds returns.
    """
    columns = {
        name.lower(): column
        for name, column in sorted(scan.fields.items())  # lower case last: the exact name wins
        if column.ndim == 1 and column.dtype.kind in "iuf"
    }
    return next((stated for read in _READERS if (stated := read(scan, columns))), None)


def _from_numbers(scan: Scan, columns: Columns) -> StatedReturns | None:
    name = next((name for name in NUMBER_NAMES if name in columns), None)
    if name is None:
        return None
    number = _whole(columns[name])
    count = next((_whole(columns[title]) for title in COUNT_NAMES if title in columns), None)
    if count is None:
        return _from_numbers_alone(scan, name, number)
    return _from_numbers_and_counts(scan, name, number, count)


def _from_las_bits(scan: Scan, columns: Columns) -> StatedReturns | None:
    bits = columns.get("bit_fields")
    if bits is None or bits.dtype != np.uint8:
        return None
    # Point formats 6 to 10 have four bits for each number, and flags in a byte of their own; 0 to 5
    # have three. Source: ASPRS, LAS Specification 1.4.
    width = 4 if "classification_flags" in columns else 3
    ones = (1 << width) - 1
    bits = bits.astype(np.int64)
    return _from_numbers_and_counts(scan, "bit_fields", bits & ones, bits >> width & ones)


def _from_numbers_and_counts(
    scan: Scan, name: str, number: Ints, count: Ints
) -> StatedReturns | None:
    """Returns by numbers from 1, if the number of returns of each ray is known."""
    several = scan.valid & (count > 1) & (number >= 1) & (number <= count)
    if not several.any():
        return None
    stated = np.where(several, number, -1)
    return StatedReturns(name, stated, several & (number < count), several & (number > 1))


def _from_types(scan: Scan, columns: Columns) -> StatedReturns | None:
    if "return_type" not in columns:
        return None
    kind = _whole(columns["return_type"])
    present = set(np.unique(kind[scan.valid]).tolist())
    if present & NEBULA_TELLS:
        front, behind = NEBULA
    elif max(present, default=0) <= AUTOWARE_LARGEST and (present >= {3, 6} or present >= {4, 5}):
        front, behind = AUTOWARE
    else:
        return None
    nearer, farther = scan.valid & np.isin(kind, front), scan.valid & np.isin(kind, behind)
    number = np.where(nearer, 1, np.where(farther, 2, -1))
    return StatedReturns("return_type", number, nearer, farther)


def _from_tags(scan: Scan, columns: Columns) -> StatedReturns | None:
    if "tag" not in columns or columns["tag"].dtype.kind not in "iu":
        return None
    return _from_numbers_alone(scan, "tag", _whole(columns["tag"]) >> 4 & 3)


def _from_second_ranges(scan: Scan, columns: Columns) -> StatedReturns | None:
    if not {"range", "range2"} <= columns.keys():
        return None
    first, second = (columns[name].astype(np.float64) for name in ("range", "range2"))
    both = scan.valid & (first > 0) & (second > 0) & np.isfinite(first) & np.isfinite(second)
    if not both.any():
        return None
    # Whatever the unit of the columns is, the coordinates are in metres.
    other = np.zeros(len(scan))
    with np.errstate(over="ignore"):
        other[both] = scan.range[both] * (second[both] / first[both])
    both &= other <= LARGEST_COORDINATE
    nearer = both & (other - scan.range >= LEAST_APART)
    farther = both & (scan.range - other >= LEAST_APART)
    return StatedReturns("range2", np.full(len(scan), -1), nearer, farther)


def _from_numbers_alone(scan: Scan, name: str, number: Ints) -> StatedReturns | None:
    """Returns by numbers from 0 or 1, if the number of returns of each ray is not known.

    The first return may be the only one of its ray; directions have to decide that.
    """
    numbers = number[scan.valid]
    if not len(numbers) or numbers.min() == numbers.max():
        return None
    farther = scan.valid & (number > numbers.min())
    return StatedReturns(name, number, np.zeros(len(scan), bool), farther)


def _whole(column: Array) -> Ints:
    """A column as whole numbers; values that are not finite or too large are -1."""
    if column.dtype.kind != "f":
        return column.astype(np.int64)
    return np.where(np.abs(column) < 2**31, column, -1).astype(np.int64)


_READERS = (_from_numbers, _from_las_bits, _from_types, _from_tags, _from_second_ranges)
