"""What precipitation is drawn from, and reading it."""

import math
from dataclasses import fields, replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.flying.kinds import KINDS, Kind, PrecipitationSpans, draw_precipitation
from derain.simulation.flying.precipitation import Precipitation


def read(value: object) -> PrecipitationSpans:
    return PrecipitationSpans.of(Entry(Path("world.yaml"), "precipitation", value))


@settings(max_examples=80, deadline=None)
@given(seed=st.integers(0, 2**32), name=st.sampled_from(sorted(KINDS)))
def test_every_number_is_within_its_span_or_switched_off(seed: int, name: str) -> None:
    kind = KINDS[name]
    drawn = kind.draw(name, np.random.default_rng(seed))
    assert drawn.kind == name
    assert {type(getattr(drawn, one.name)) for one in fields(drawn)} == {str, int, float}
    for one in fields(kind):
        if isinstance(span := getattr(kind, one.name), tuple):
            off = one.name in ("reach", "cut_off", "drift", "haze")
            value = getattr(drawn, one.name)
            assert span[0] <= value <= span[1] or (off and value in (0, np.inf)), one.name
    assert drawn == kind.draw(name, np.random.default_rng(seed))


def test_kinds_are_drawn_by_their_weights() -> None:
    spans = read({"snow": {"weight": 3}, "rain": {"weight": 1}, "fog": {"weight": 0}})
    generator = np.random.default_rng(1)
    names = [draw_precipitation(spans, generator).kind for _ in range(2000)]
    assert set(names) == {"snow", "rain"}
    assert names.count("snow") == pytest.approx(1500, abs=4 * np.sqrt(2000 * 3 / 16))


def test_chances_are_those_stated() -> None:
    kind = Kind(reach_chance=0.25, cut_off_chance=1, gust_chance=0, drift_chance=0.5)
    generator = np.random.default_rng(2)
    drawn = [kind.draw("rain", generator) for _ in range(1000)]
    assert sum(one.reach > 0 for one in drawn) == pytest.approx(250, abs=4 * 14)
    assert sum(one.drift > 0 for one in drawn) == pytest.approx(500, abs=4 * 16)
    assert all(np.isfinite(one.cut_off) for one in drawn)
    assert all(one.gust_form == "even" for one in drawn)
    assert all(one.plumes == 0 for one in drawn)


def test_numbers_over_decades_are_even_in_their_logarithms() -> None:
    kind, generator = Kind(number=(1, 10_000)), np.random.default_rng(3)
    below = sum(kind.draw("snow", generator).number < 100 for _ in range(1000))
    assert below == pytest.approx(500, abs=64)


def test_what_a_document_leaves_out_stays_as_it_is() -> None:
    spans = read({"snow": {"number": [10, 20.5], "reach_chance": 0}})
    ((name, kind),) = spans.kinds
    assert name == "snow"
    assert kind.number == (10, 20.5)
    assert kind.reach_chance == 0
    assert kind.diameter == KINDS["snow"].diameter
    assert dict(PrecipitationSpans().kinds) == KINDS


@pytest.mark.parametrize(
    ("value", "named"),
    [
        ({"hail": {}}, "hail"),
        ({"snow": {"colour": [1, 2]}}, "colour"),
        ({"snow": {"number": [2, 1]}}, "number"),
        ({"snow": {"number": [0, 1]}}, "number"),
        ({"snow": {"reflectivity": [0.5, 1.5]}}, "reflectivity"),
        ({"snow": {"largest": [4, 400]}}, "largest"),
        ({"snow": {"spill": [0.5, 1]}}, "spill"),
        ({"snow": {"number": 5}}, "number"),
        ({"snow": {"haze_chance": 2}}, "haze_chance"),
        ({"snow": {"weight": -1}}, "weight"),
        ({"snow": {"weight": 0}}, "weight"),
        ({}, "weight"),
        ([1], "mapping"),
    ],
)
def test_a_wrong_document_is_refused_with_its_place(value: object, named: str) -> None:
    with pytest.raises(InputError, match=r"world\.yaml") as caught:
        read(value)
    assert named in str(caught.value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("number", -1.0),
        ("number", math.nan),
        ("number", math.inf),
        ("diameter", 0.0),
        ("largest", 0.1),
        ("largest", 100.0),
        ("reflectivity", 1.1),
        ("flicker", 1.0),
        ("spill", 0.9),
        ("cut_off", 0.0),
        ("crowding", math.nan),
        ("jitter", -0.1),
        ("gust_form", "storm"),
        ("haze", 1.5),
        ("haze_strength", 0.5),
        ("plumes", -1),
    ],
)
def test_precipitation_that_cannot_be_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(InputError, match=name):
        replace(Precipitation(), **{name: value})
