"""Draws where the rows of a spinning sensor point: evenly, or closer together at the horizon."""

import numpy as np
from numpy.typing import NDArray

# Where the rows of uneven sensors lie closer together than elsewhere, degrees above the horizon:
# lowest and highest place of the band's lower and of its upper edge. That of Pandar64 reaches from
# -6 to 2, that of HDL-64 from -8.3 to 2.
DENSE_BAND = ((-9.0, -3.0), (0.0, 4.0))

# How many times closer: 1.5 in HDL-64, about 8 in Pandar64.
HOW_MUCH_CLOSER = (1.4, 8.0)

# A sensor is not made more exactly than that: deviation of a row from where it should point, as a
# share of the step between rows.
MISALIGNMENT = 0.05


def draw_row_table(
    field: tuple[float, float], rows: int, generator: np.random.Generator, *, even: bool
) -> tuple[float, ...]:
    """Draws a table of row inclinations.

    Args:
        field: Lowest and highest row, degrees.
        rows: How many, two or more.
        generator: Random generator.
        even: Whether all steps are alike, but for some misalignment.

    Returns:
        Inclinations from top to bottom, degrees, all within the field.
    """
    lowest, highest = field
    corners, density = np.array(field), np.ones(1)
    if not even:
        band = np.clip([generator.uniform(*span) for span in DENSE_BAND], lowest, highest)
        closer = generator.uniform(*HOW_MUCH_CLOSER)
        corners, density = np.array([lowest, *band, highest]), np.array([1.0, closer, 1.0])
    table = _spaced(corners, density, rows)
    table += MISALIGNMENT * np.gradient(table) * generator.normal(size=rows)
    return tuple(np.clip(np.sort(table), lowest, highest)[::-1].round(3).tolist())


def _spaced(
    corners: NDArray[np.float64], density: NDArray[np.float64], count: int
) -> NDArray[np.float64]:
    """So many places from the first corner to the last, spaced by the density between corners."""
    passed = np.concatenate([[0.0], np.cumsum(density * np.diff(corners))])
    places: NDArray[np.float64] = np.interp(np.linspace(0, passed[-1], count), passed, corners)
    return places


def draw_row_azimuths(rows: int, most: float, generator: np.random.Generator) -> tuple[float, ...]:
    """Draws by how much the rows of a sensor are turned, degrees.

    Lasers lie in one line, in a few columns beside one another which take the rows in turn (Ouster,
    HDL-64), or each a little aside as its calibration says.

    Args:
        rows: How many rows.
        most: Most that a row is turned either way.
        generator: Random generator.

    Returns:
        Turns from top to bottom; empty where there are none.
    """
    match generator.choice(["one line", "few columns", "each by itself"]):
        case "one line":
            return ()
        case "few columns":
            columns = generator.integers(2, 9)
            turns = most * np.linspace(1, -1, columns)[np.arange(rows) % columns]
        case _:
            turns = generator.uniform(-most, most, rows)
    return tuple(turns.round(3).tolist())
