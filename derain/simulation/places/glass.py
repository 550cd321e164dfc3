"""Glass: most rays go through it, some are returned by dirt, stickers and reflections.

A pane is a grid of cells of which only some are there. A ray that meets none goes on to what is
behind, as it does through real glass; where it meets one it returns weakly, by itself.
"""

import numpy as np
from numpy.typing import NDArray

from derain.simulation import shapes
from derain.simulation.places.drawing import evenly_in_logarithm
from derain.simulation.shapes import Triangles

CELL = 0.04
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
    cell = max(CELL, float(np.sqrt(sides.prod() / MOST_CELLS)))
    u, v = (np.linspace(0, 1, 2 + int(side / cell))[..., None] for side in sides)
    u, v = u[:, None], v[None]
    first, second, third, fourth = corners
    grid = (1 - u) * (1 - v) * first + u * (1 - v) * second + u * v * third + (1 - u) * v * fourth
    cells = shapes.sheet(grid).reshape(-1, 2, 3, 3)
    there = generator.random(len(cells)) < evenly_in_logarithm(RETURNING, generator)
    there[0] = True  # a pane is never nothing at all
    return cells[there].reshape(-1, 3, 3)
