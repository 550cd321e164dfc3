"""What precipitation is drawn from, and reading it."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.files.documents import Entry
from derain.simulation.flying.precipitation import (
    KINDS,
    Kind,
    Precipitation,
    draw_precipitation,
    kinds_of,
)


def read(value: object) -> dict[str, Kind]:
    return kinds_of(Entry("world.yaml", "precipitation", value))


@given(seed=st.integers(0, 2**32), name=st.sampled_from(sorted(KINDS)))
def test_every_number_is_within_its_span_or_switched_off(seed, name) -> None:
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


def test_kinds_chances_and_numbers_come_as_often_as_stated() -> None:
    kinds = read({"snow": {"weight": 3, "number": [1, 10_000]}, "rain": {}, "fog": {"weight": 0}})
    generator = np.random.default_rng(1)
    drawn = [draw_precipitation(kinds, generator) for _ in range(2000)]
    snow = [one for one in drawn if one.kind == "snow"]
    assert {one.kind for one in drawn} == {"snow", "rain"}
    for count, of, share in (
        (len(snow), 2000, 0.75),
        (sum(one.number < 100 for one in snow), len(snow), 0.5),  # even in its logarithm
        (sum(one.reach > 0 for one in snow), len(snow), KINDS["snow"].reach_chance),
        (sum(one.drift > 0 for one in snow), len(snow), KINDS["snow"].drift_chance),
        (sum(one.plumes > 0 for one in snow), len(snow), KINDS["snow"].plume_chance),
        (sum(one.haze > 0 for one in snow), len(snow), KINDS["snow"].haze_chance),
        (sum(np.isfinite(one.cut_off) for one in snow), len(snow), KINDS["snow"].cut_off_chance),
        (sum(one.gust_form != "even" for one in snow), len(snow), KINDS["snow"].gust_chance),
    ):
        assert count == pytest.approx(of * share, abs=4 * math.sqrt(of * share * (1 - share)))


def test_what_a_document_leaves_out_stays_as_it_is() -> None:
    kinds = read({"snow": {"number": [10, 20.5], "reach_chance": 0}})
    assert kinds == {"snow": replace(KINDS["snow"], number=(10, 20.5), reach_chance=0)}


@pytest.mark.parametrize(
    ("value", "named"),
    [
        ({"hail": {}}, "hail"),
        ({"snow": {"number": [2, 1]}}, "number"),
        ({"snow": {"number": [0, 1]}}, "number"),
        ({"snow": {"number": [1, 1e10]}}, "number"),
        ({"snow": {"haze_chance": 2}}, "haze_chance"),
        ({"snow": {"weight": -1}}, "weight"),
    ],
)
def test_a_wrong_document_is_refused_with_its_place(value, named) -> None:
    with pytest.raises(InputError, match=rf"world\.yaml: .*{named}"):
        read(value)


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("number", math.nan),
        ("number", math.inf),
        ("diameter", 0.0),
        ("largest", 100.0),
        ("reflectivity", 1.1),
        ("flicker", 1.0),
        ("spill", 0.9),
        ("cut_off", 0.0),
        ("crowding", math.nan),
        ("gust_form", "storm"),
        ("haze_strength", 0.5),
    ],
)
def test_precipitation_that_cannot_be_is_refused_by_name(name, value) -> None:
    with pytest.raises(InputError, match=name):
        replace(Precipitation(), **{name: value})
    if not isinstance(value, str):  # a kind is drawn from what can be
        with pytest.raises(InputError, match=name):
            Kind(**{name: (value, value)})
