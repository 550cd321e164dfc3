"""Drawn sensors are possible, as various as stated, and the same for the same seed."""

from dataclasses import fields

import numpy as np
import pytest
import yaml

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.drawn_sensor import (
    MISALIGNMENT,
    NUMBERS,
    DefectSpans,
    SensorSpans,
    draw_defects,
    draw_row_azimuths,
    draw_row_table,
    draw_sensor,
)
from derain.simulation.sensor import Sensor
from derain.simulation.settings import LogSpan

SPANS = SensorSpans()


@pytest.fixture(scope="module")
def drawn() -> list[Sensor]:
    return [draw_sensor(SPANS, np.random.default_rng(seed)) for seed in range(400)]


def test_values_lie_in_their_spans_evenly_or_evenly_in_their_logarithms(drawn) -> None:
    logarithmic = {field.name for field in fields(SPANS) if field.type == LogSpan}
    assert len(NUMBERS) == 12
    for name in NUMBERS:
        span, values = getattr(SPANS, name), [getattr(sensor, name) for sensor in drawn]
        assert span[0] <= min(values) <= max(values) <= span[1]
        middle = np.sqrt(np.prod(span)) if name in logarithmic else np.mean(span)
        assert np.mean(np.array(values) < middle) == pytest.approx(0.5, abs=0.1)
    roll, pitch = np.array([sensor.tilt for sensor in drawn]).T
    assert np.abs(roll).max() <= SPANS.tilt[1]
    assert np.mean(pitch > SPANS.tilt[1]) == pytest.approx(SPANS.head_down, abs=0.06)
    assert draw_sensor(SPANS, np.random.default_rng(7)) == drawn[7]


def test_kinds_and_returns_come_by_their_weights(drawn) -> None:
    spinning = [sensor.azimuth == (-180, 180) for sensor in drawn]
    rosette = [sensor.pattern == "rosette" for sensor in drawn]
    dual = [sensor.returns == "dual" for sensor in drawn]
    for found, name in ((spinning, "spinning"), (rosette, "rosette")):
        assert np.mean(found) == pytest.approx(SPANS.kinds[name], abs=0.1)
    assert np.mean(dual) == pytest.approx(SPANS.returns["dual"], abs=0.1)
    rows = {sensor.rows for sensor in drawn if sensor.azimuth == (-180, 180)}
    assert rows == set(SPANS.spinning_rows)


def test_columns_are_as_far_apart_as_stated_or_farther_where_beams_would_be_too_many(drawn) -> None:
    low, high = SPANS.azimuth_step
    for sensor in drawn:
        if sensor.azimuth == (-180, 180):
            step = 360 / sensor.columns
            assert low - 0.001 <= step
            assert step <= high or (sensor.columns + 1) * sensor.rows > SPANS.most_beams


def test_defects_are_drawn_as_often_as_stated() -> None:
    spans, generator = DefectSpans(none=0.4, each=0.25), np.random.default_rng(0)
    found = [draw_defects(spans, generator, dual=False) for _ in range(2000)]
    for name in ("dropped", "dropped_rows", "dropped_sectors", "mixed", "range_step"):
        values = np.array([getattr(defects, name) for defects in found])
        assert np.count_nonzero(values) / 2000 == pytest.approx(0.6 * 0.25, abs=0.04)
        assert values.max() <= getattr(spans, name)[1]
    assert not any(defects.copies for defects in found)
    # Half of the dual sensors report all returns twice.
    copies = [draw_defects(spans, generator, dual=True).copies for _ in range(1000)]
    assert set(copies) == {0.0, 1.0}
    assert np.mean(copies) == pytest.approx(0.5, abs=0.07)


SEEDS = range(20)


@pytest.mark.parametrize("field", [(-25.0, 15.0), (-60.0, -20.0), (5.0, 90.0)])
@pytest.mark.parametrize("even", [True, False])
def test_rows_go_from_top_to_bottom_within_the_field_and_closer_at_the_horizon_if_uneven(
    field, even
) -> None:
    low, high = field
    for seed in SEEDS:
        table = np.array(draw_row_table(field, 128, np.random.default_rng(seed), even=even))
        assert len(table) == 128
        assert (np.diff(table) <= 0).all()
        assert low <= table.min() <= table.max() <= high
        assert table[0] - table[-1] > 0.97 * (high - low)
        if even:
            stray = (table - np.linspace(high, low, 128)) / ((high - low) / 127)
            assert stray.std() < 1.5 * MISALIGNMENT
            assert np.abs(stray).max() < 5 * MISALIGNMENT
        elif low < 0 < high:
            steps = -np.diff(table)
            middle = table[:-1] - steps / 2
            dense = np.median(steps[(middle > -2.5) & (middle < -0.5)])
            assert 1.3 < np.median(steps[(middle < -10) | (middle > 5)]) / dense < 9


def test_rows_are_turned_by_no_more_than_stated_if_at_all() -> None:
    drawn = [draw_row_azimuths(32, 3.0, np.random.default_rng(seed)) for seed in SEEDS]
    assert {len(turns) for turns in drawn} == {0, 32}
    assert max(max(map(abs, turns)) for turns in drawn if turns) == pytest.approx(3, abs=0.1)
    assert max(len(set(turns)) for turns in drawn) == 32  # each by itself
    assert min(len(set(turns)) for turns in drawn if turns) <= 8  # few columns


def read(content: str) -> SensorSpans:
    return SensorSpans.of(Entry("spans.yaml", "", yaml.safe_load(content)))


def test_a_document_states_what_differs_from_the_defaults() -> None:
    assert read("{}") == SensorSpans()
    content = "kinds: {front: 1}\ntilt: [0, 1]\nfront_rows: [64]\ndefects: {dropped: [0, 0.1]}"
    assert read(content) == SensorSpans(
        kinds={"front": 1.0},
        tilt=(0, 1),
        front_rows=(64,),
        defects=DefectSpans(dropped=(0, 0.1)),
    )


@pytest.mark.parametrize(
    ("content", "named"),
    [
        ("tilt: [3, 1]", "tilt"),
        ("detection_threshold: [-1, 1]", "detection_threshold"),
        ("kinds: {round: 1}", "kinds"),
        ("kinds: {front: -1, spinning: 2}", "kinds"),
        ("returns: {first: 1}", "returns"),
        ("spinning_rows: []", "spinning_rows"),
        ("uneven: 1.5", "uneven"),
        ("most_beams: 0", "most_beams"),
        ("defects: {none: 2}", "none"),
        ("defects: {dropped: [0.2, 0.1]}", "dropped"),
    ],
)
def test_what_is_impossible_is_refused_by_name(content, named) -> None:
    with pytest.raises(InputError, match=rf"spans\.yaml: .*{named}"):
        read(content)
