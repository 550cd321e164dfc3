"""Glass: most rays go through it, some are returned by dirt, stickers and reflections.

A pane is a grid of cells of which only some are there. A ray that meets none goes on to what is
behind, as it does through real glass; where it meets one it returns weakly, by itself.
"""

import numpy as np
from numpy.typing import NDArray

from derain.simulation.drawing import log_uniform
from derain.simulation.shapes import Triangles

GLASS_CELL = 0.04
MOST_CELLS = 900

# Share of a pane that returns a ray: of clean glass, and of a dirty or frosted pane.
RETURNING = (0.005, 0.6)


def pane(corners: NDArray[np.float64], generator: np.random.Generator) -> Triangles:
    """A pane of glass.

    Args:
        corners: Its four corners in order, (4, 3), metres.
        generator: Random generator.
    """
    sides = np.linalg.norm(corners[[1, 3]] - corners[0], axis=1)
    cell = max(GLASS_CELL, float(np.sqrt(sides.prod() / MOST_CELLS)))
    wide, high = (1 + int(side / cell) for side in sides)
    share = log_uniform(RETURNING, generator)
    # A pane is never nothing at all.
    there = generator.permutation(wide * high)[: 1 + generator.binomial(wide * high - 1, share)]
    column, row = there % wide, there // wide
    u, v = ((edge / count)[:, None] for edge, count in ((column, wide), (row, high)))
    at = [
        _between(corners, u + i / wide, v + j / high) for i, j in ((0, 0), (1, 0), (1, 1), (0, 1))
    ]
    return np.stack([at[i] for i in (0, 1, 2, 0, 2, 3)], axis=1).reshape(-1, 3, 3)


def _between(
    corners: NDArray[np.float64], u: NDArray[np.float64], v: NDArray[np.float64]
) -> NDArray[np.float64]:
    """Places by their shares of the way from the first corner to the second and to the fourth."""
    first, second, third, fourth = corners
    lower: NDArray[np.float64] = (1 - u) * first + u * second
    upper: NDArray[np.float64] = (1 - u) * fourth + u * third
    return (1 - v) * lower + v * upper
