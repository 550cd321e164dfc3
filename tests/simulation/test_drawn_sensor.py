"""Drawn sensors are possible, as various as stated, and the same for the same seed."""

from dataclasses import fields

import numpy as np
import pytest

from derain.simulation.defects import Defects
from derain.simulation.drawn_sensor import (
    MISALIGNMENT,
    draw_defects,
    draw_row_azimuths,
    draw_row_table,
    draw_sensor,
)
from derain.simulation.sensor import Returns, Sensor
from derain.simulation.spans import DefectSpans, SensorSpans

SPANS = SensorSpans()


@pytest.fixture(scope="module")
def drawn() -> list[Sensor]:
    return [draw_sensor(SPANS, np.random.default_rng(seed)) for seed in range(400)]


def share(of: list[bool]) -> float:
    return sum(of) / len(of)


def test_the_same_seed_gives_the_same_sensor(drawn: list[Sensor]) -> None:
    assert draw_sensor(SPANS, np.random.default_rng(7)) == drawn[7] != drawn[8]


def test_drawn_sensors_have_beams_of_unit_length_and_not_too_many(drawn: list[Sensor]) -> None:
    for sensor in drawn[:20]:
        beams = sensor.beams()
        assert len(beams) == sensor.rows * sensor.columns <= SPANS.most_beams
        assert np.allclose(np.linalg.norm(beams, axis=1), 1)


def test_values_lie_in_their_spans(drawn: list[Sensor]) -> None:
    spanned = {field.name for field in fields(SPANS)} & {field.name for field in fields(Sensor)}
    spanned -= {"returns", "tilt", "prism_turns", "defects"}
    assert len(spanned) == 12
    for name in spanned:
        low, high = getattr(SPANS, name)
        values = [getattr(sensor, name) for sensor in drawn]
        assert low <= min(values) <= max(values) <= high
        assert len(set(values)) > 390
    roll, pitch = np.array([sensor.tilt for sensor in drawn]).T
    assert np.abs(roll).max() <= SPANS.tilt[1]
    assert share(list(pitch > SPANS.tilt[1])) == pytest.approx(SPANS.head_down, abs=0.06)


def test_kinds_and_returns_come_by_their_weights(drawn: list[Sensor]) -> None:
    spinning = [sensor.azimuth == (-180, 180) for sensor in drawn]
    rosette = [sensor.pattern == "rosette" for sensor in drawn]
    dual = [sensor.returns == "dual" for sensor in drawn]
    for found, name in ((spinning, "spinning"), (rosette, "rosette")):
        assert share(found) == pytest.approx(SPANS.kinds[name], abs=0.1)
    assert share(dual) == pytest.approx(SPANS.returns["dual"], abs=0.1)
    assert {sensor.rows for sensor in drawn if sensor.azimuth == (-180, 180)} == set(
        SPANS.spinning_rows
    )


def test_columns_are_as_far_apart_as_stated_or_farther_where_beams_would_be_too_many(
    drawn: list[Sensor],
) -> None:
    low, high = SPANS.azimuth_step
    for sensor in drawn:
        if sensor.azimuth == (-180, 180):
            step = 360 / sensor.columns
            assert low - 0.001 <= step
            assert step <= high or (sensor.columns + 1) * sensor.rows > SPANS.most_beams


def test_columns_that_no_sensor_could_have_are_as_many_as_may_be() -> None:
    spans = SensorSpans(
        kinds={"spinning": 1.0}, spinning_rows=(16,), azimuth_step=(5e-324, 5e-324), most_beams=8000
    )
    assert draw_sensor(spans, np.random.default_rng(0)).columns == 500


def test_defects_are_drawn_as_often_as_stated() -> None:
    spans, generator = DefectSpans(none=0.4, each=0.25), np.random.default_rng(0)
    found = [draw_defects(spans, generator, dual=False) for _ in range(2000)]
    for name in ("dropped", "dropped_rows", "dropped_sectors", "mixed", "range_step"):
        values = np.array([getattr(defects, name) for defects in found])
        assert np.count_nonzero(values) / 2000 == pytest.approx(0.6 * 0.25, abs=0.04)
        assert values.max() <= getattr(spans, name)[1]
    assert not any(defects.copies for defects in found)


def test_half_of_dual_sensors_report_all_returns_twice() -> None:
    generator = np.random.default_rng(0)
    copies = [draw_defects(DefectSpans(), generator, dual=True).copies for _ in range(1000)]
    assert set(copies) == {0.0, 1.0}
    assert np.mean(copies) == pytest.approx(0.5, abs=0.07)
    nothing = DefectSpans(none=1.0)
    found = draw_defects(nothing, generator, dual=False)
    assert found == Defects(merging=found.merging)


def test_a_drawn_sensor_measures_finite_points_in_its_reach(drawn: list[Sensor]) -> None:
    for seed, sensor in enumerate(drawn[:12]):
        generator = np.random.default_rng(seed)
        beams = sensor.rows * sensor.columns
        returns = Returns(
            generator.uniform(sensor.minimum_range, sensor.maximum_range, beams),
            generator.random(beams),
            np.zeros(beams, np.int64),
            np.arange(beams),
        )
        scan = sensor.measure(returns, generator)
        assert np.isfinite(scan.xyz).all()
        assert scan.range.max() < sensor.maximum_range + 2
        assert 0.5 * beams < len(scan) <= 2 * beams


SEEDS = range(30)


@pytest.mark.parametrize("even", [True, False])
def test_rows_go_from_top_to_bottom_within_the_field(even: bool) -> None:
    for seed in SEEDS:
        table = np.array(draw_row_table((-25, 15), 64, np.random.default_rng(seed), even=even))
        assert len(table) == 64
        assert (np.diff(table) <= 0).all()
        assert -25 <= table.min() <= table.max() <= 15
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
        assert field[0] <= table.min() <= table.max() <= field[1]


def test_rows_are_turned_by_no_more_than_stated_if_at_all() -> None:
    drawn = [draw_row_azimuths(32, 3.0, np.random.default_rng(seed)) for seed in SEEDS]
    assert {len(turns) for turns in drawn} == {0, 32}
    assert max(max(map(abs, turns)) for turns in drawn if turns) == pytest.approx(3, abs=0.1)
    assert max(len(set(turns)) for turns in drawn) == 32  # each by itself
    assert min(len(set(turns)) for turns in drawn if turns) <= 8  # few columns
