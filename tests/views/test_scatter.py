"""The closed form of the smallest eigenvalue, against NumPy's."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.scan import Floats
from derain.views.scatter import scatter_through_space

clouds = hnp.arrays(
    np.float64, st.tuples(st.integers(1, 12), st.just(3)), elements=st.floats(-50, 50, width=32)
)


def by_numpy(xyz: Floats) -> float:
    values = np.linalg.eigvalsh(np.cov(xyz.T, bias=True).reshape(3, 3))
    return max(values[0], 0) / values.sum() if values.sum() > 0 else 0


def of_one(xyz: Floats) -> float:
    return float(scatter_through_space(xyz, np.arange(len(xyz))[None])[0])


@given(clouds)
def test_it_is_the_share_of_the_smallest_eigenvalue(xyz) -> None:
    if np.ptp(xyz, axis=0).max() > 1e-3:  # below, the mean of far numbers rounds it away
        assert of_one(xyz) == pytest.approx(by_numpy(xyz), abs=1e-7)


@pytest.mark.parametrize("size", [1e-6, 1.0, 1e6])
@pytest.mark.parametrize(
    ("xyz", "expected"),
    [
        ([[0, 0, 0]] * 5, 0),
        ([[0, 0, 0], [1, 2, 3], [2, 4, 6]], 0),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0], [3, 2, 0]], 0),
        ([[1, 0, 0], [-1, 0, 0], [0, 1, 0], [0, -1, 0], [0, 0, 1], [0, 0, -1]], 1 / 3),
        ([[2, 0, 0], [-2, 0, 0], [0, 2, 0], [0, -2, 0], [0, 0, 1], [0, 0, -1]], 1 / 9),
    ],
)
def test_what_is_known_of_places_lines_planes_and_stars(xyz, expected, size) -> None:
    assert of_one(np.array(xyz, np.float64) * size) == pytest.approx(expected, abs=1e-8)


def test_neighbourhoods_are_looked_at_one_by_one() -> None:
    generator = np.random.default_rng(3)
    xyz, neighbours = generator.normal(size=(40, 3)), generator.integers(0, 40, (25, 8))
    expected = [by_numpy(xyz[rows]) for rows in neighbours]
    np.testing.assert_allclose(scatter_through_space(xyz, neighbours), expected, atol=1e-12)
    assert scatter_through_space(xyz, neighbours[:0]).shape == (0,)
