"""Where a sensor looked: the convex hull of its returns, against what is known of hulls."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from derain.simulation.footprint import in_hull

# On a lattice, so that corners coincide, lie one above the other and three in a line.
lattice = st.tuples(st.integers(-4, 4), st.integers(-4, 4))
polygons = st.lists(lattice, min_size=1, max_size=12)


def columns(points: list[tuple[float, float]]) -> tuple[np.ndarray, np.ndarray]:
    x, y = np.array(points, float).T
    return x, y


@given(polygons, lattice)
def test_a_place_is_outside_if_a_line_parts_it_from_every_point(
    points: list[tuple[int, int]], place: tuple[int, int]
) -> None:
    away = np.array(points) - place
    # Hulls of such points have edges in these directions only; so do the lines that part.
    steps = [(a, b) for a in range(-8, 9) for b in range(-8, 9) if (a, b) != (0, 0)]
    parted = any((away @ np.array(normal) > 0).all() for normal in steps)
    assert in_hull(columns(points), columns([place])).all() == (not parted)
