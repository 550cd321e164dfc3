"""What a drive may be."""

import math
from typing import Any

import pytest

from derain.errors import InputError
from derain.simulation.drive import LONGEST, Drive


def test_a_drive_is_as_long_as_its_speed_takes_it() -> None:
    assert Drive(speed=13).length(0.5) == 6.5
    assert Drive(traffic=3).length(1e6) == 0


def test_a_drive_longer_than_any_street_is_refused() -> None:
    assert Drive(speed=10).length(LONGEST / 10) == LONGEST
    with pytest.raises(InputError, match=r"201 s at 10 m/s are 2,010 m of street, more than 2,000"):
        Drive(speed=10).length(201)


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"speed": -1.0}, "speed: -1.0 m/s is impossible"),
        ({"speed": math.nan}, "speed: nan m/s is impossible"),
        ({"speed": math.inf}, "speed: inf m/s is impossible"),
        ({"skew": True}, "skew: there is none where nothing moves"),
        ({"traffic": -1}, "traffic: -1 is impossible"),
        ({"traffic": 10**9}, "traffic: 1000000000 is impossible"),
    ],
)
def test_an_impossible_drive_is_refused(wrong: dict[str, Any], message: str) -> None:
    with pytest.raises(InputError, match=message):
        Drive(**wrong)
