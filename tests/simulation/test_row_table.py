"""Drawn row tables: within the field, in order, and closer together where they should be."""

import numpy as np
import pytest

from derain.simulation.row_table import MISALIGNMENT, draw_row_azimuths, draw_row_table

SEEDS = range(30)


@pytest.mark.parametrize("even", [True, False])
def test_rows_go_from_top_to_bottom_within_the_field(even: bool) -> None:
    for seed in SEEDS:
        table = np.array(draw_row_table((-25, 15), 64, np.random.default_rng(seed), even=even))
        assert len(table) == 64
        assert (np.diff(table) <= 0).all()
        assert table.max() <= 15
        assert table.min() >= -25
        assert table[0] - table[-1] > 39


def test_even_rows_are_a_step_apart_but_for_misalignment() -> None:
    step = 40 / 63
    for seed in SEEDS:
        table = np.array(draw_row_table((-25, 15), 64, np.random.default_rng(seed), even=True))
        stray = table - np.linspace(15, -25, 64)
        assert stray.std() < 1.5 * MISALIGNMENT * step
        assert np.abs(stray).max() < 5 * MISALIGNMENT * step


def test_uneven_rows_are_closer_together_at_the_horizon() -> None:
    for seed in SEEDS:
        table = np.array(draw_row_table((-25, 15), 128, np.random.default_rng(seed), even=False))
        steps = -np.diff(table)
        middle = table[:-1] + np.diff(table) / 2
        dense = np.median(steps[(middle > -2.5) & (middle < -0.5)])
        outside = np.median(steps[(middle < -10) | (middle > 5)])
        assert 1.3 < outside / dense < 9


def test_a_field_beside_the_horizon_has_rows_as_well() -> None:
    for field in ((-60.0, -20.0), (5.0, 90.0)):
        table = np.array(draw_row_table(field, 16, np.random.default_rng(0), even=False))
        assert len(table) == 16
        assert table.min() >= field[0]
        assert table.max() <= field[1]


def test_rows_are_turned_by_no_more_than_stated_if_at_all() -> None:
    drawn = [draw_row_azimuths(32, 3.0, np.random.default_rng(seed)) for seed in SEEDS]
    assert {len(turns) for turns in drawn} == {0, 32}
    assert max(max(map(abs, turns)) for turns in drawn if turns) == pytest.approx(3, abs=0.1)
    assert max(len(set(turns)) for turns in drawn) == 32  # each by itself
    assert min(len(set(turns)) for turns in drawn if turns) <= 8  # few columns
