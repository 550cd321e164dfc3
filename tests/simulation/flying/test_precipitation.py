"""What precipitation may be."""

import math
from dataclasses import replace

import pytest

from derain.errors import InputError
from derain.simulation.flying.precipitation import Precipitation


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
def test_what_cannot_be_is_refused_by_name(name: str, value: object) -> None:
    with pytest.raises(InputError, match=name):
        replace(Precipitation(), **{name: value})
