"""Decisions by waves, against a loop over the points in their order."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from numpy.typing import NDArray

from derain.filters.random_field import decide_sequentially


def by_loop(
    feature: NDArray[np.float64],
    rows: NDArray[np.int64],
    place: NDArray[np.int64],
    neighbours: NDArray[np.int64],
    distances: NDArray[np.float32],
    vote: float,
) -> NDArray[np.bool_]:
    """The definition, one point after the other."""
    said = [vote if f > 0.6 else -vote if f < -0.4 else f for f in feature.tolist()]
    rain = [f > 0.6 for f in feature.tolist()]
    for number in np.argsort(place).tolist():
        point = int(rows[number])
        if not -0.4 < feature[point] <= 0.6:
            continue
        total = float(feature[point])
        for other, apart in zip(neighbours[number, 1:], distances[number, 1:], strict=True):
            total += said[other] * (1 / (0.01 + float(apart)))
        rain[point] = total > 0
        said[point] = vote if total > 0 else -vote
    return np.array(rain, bool)


@settings(deadline=None, max_examples=150)
@given(
    st.integers(0, 2**32 - 1), st.integers(1, 60), st.integers(1, 8), st.sampled_from([0, 0.3, 2])
)
def test_waves_decide_as_a_loop_does(seed: int, points: int, size: int, vote: float) -> None:
    generator = np.random.default_rng(seed)
    feature = generator.choice([-1.0, -0.4, -0.39, -0.1, 0.05, 0.1, 0.6, 0.7], points)
    rows = np.flatnonzero((feature > -1) | (generator.random(points) < 0.3))
    neighbours = generator.integers(0, points, (len(rows), size))
    neighbours[:, 0] = rows
    distances = np.sort(generator.choice([0.0, 0.1, 0.5, 3.0], neighbours.shape), axis=1)
    of_field = (
        feature,
        rows,
        generator.permutation(len(rows)),
        neighbours,
        distances.astype(np.float32),
        vote,
    )
    before = [np.copy(each) for each in of_field]
    np.testing.assert_array_equal(decide_sequentially(*of_field), by_loop(*of_field))
    for one, other in zip(before, of_field, strict=True):
        np.testing.assert_array_equal(one, other)


@pytest.mark.parametrize("towards", [1, -1])
def test_a_verdict_spreads_along_the_order_to_its_end(towards: int) -> None:
    points = 5000
    line = np.arange(points)
    feature = np.full(points, 0.1)
    feature[0] = -1
    neighbours = np.stack([line, np.maximum(line - 1, 0), np.minimum(line + 1, points - 1)], axis=1)
    distances = np.abs(neighbours - line[:, None]).astype(np.float32)
    place = line if towards > 0 else line[::-1]
    rain = decide_sequentially(feature, line, place, neighbours, distances, 2.0)
    # From the one that is none, "no rain" goes on and on; against the order it stays where it is.
    expected = 0 if towards > 0 else points - 2
    assert np.count_nonzero(rain) == pytest.approx(expected, abs=1)
