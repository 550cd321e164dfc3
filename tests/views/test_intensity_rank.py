"""Ranks of intensity keep its order, whatever its unit, and separate rare ones."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from derain.scan import Float32s, Scan
from derain.views.intensity_rank import INTENSITY_RANKS, intensity_rank


def of_intensities(intensity: Float32s | None, points: int) -> Scan:
    return Scan(np.ones((points, 3), np.float32), intensity=intensity)


@given(
    hnp.arrays(np.uint8, st.integers(100, 300)).filter(lambda column: len(np.unique(column)) > 1),
    st.sampled_from([1 / 255, 1.0, 257.0]),
)
def test_ranks_keep_the_order_of_intensities_in_whatever_unit(column, gain) -> None:
    intensity = column.astype(np.float32)
    rank = intensity_rank(of_intensities(intensity, len(column)))
    scaled = intensity_rank(of_intensities(intensity * np.float32(gain), len(column)))
    np.testing.assert_array_equal(rank, scaled)
    in_order = rank[np.argsort(column, kind="stable")]
    assert (np.diff(in_order) >= 0).all()
    assert in_order[0] == 0
    assert in_order[-1] < INTENSITY_RANKS


def test_as_many_levels_as_ranks_have_one_each() -> None:
    level = np.resize(np.arange(INTENSITY_RANKS), 4 * INTENSITY_RANKS)
    rank = intensity_rank(of_intensities(level.astype(np.float32), len(level)))
    np.testing.assert_array_equal(rank, level)


def test_intensities_are_separated_where_most_points_share_one() -> None:
    intensity = np.repeat(np.arange(20, dtype=np.float32), [8000] + [100] * 19)
    rank = intensity_rank(of_intensities(intensity, len(intensity)))
    assert len(np.unique(rank)) > 12


def test_without_measured_intensities_all_have_one_rank() -> None:
    for intensity in (None, np.full(200, 7, np.float32)):
        assert not intensity_rank(of_intensities(intensity, 200)).any()
