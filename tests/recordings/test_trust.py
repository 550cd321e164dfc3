"""What is believed of a registration: how it fits, and whether a vehicle could have driven so."""

from dataclasses import replace

import numpy as np
import pytest

from derain.recordings.registration import (
    FEWEST_USUAL,
    LARGEST_CHANGE,
    LARGEST_TURN,
    LEAST_FACING,
    LEAST_MATCHED,
    MOST_APART,
    TIMES_THE_USUAL,
    WELL_ENOUGH,
    Trust,
)
from derain.recordings.surfaces import Fit

from .street import motion

GOOD = Fit(np.eye(4), converged=True, residual=0.03, matched=0.9, facing=0.05)


@pytest.mark.parametrize(
    ("fault", "reason"),
    [
        ({"matched": LEAST_MATCHED - 0.01}, "only 49% of its surfaces"),
        ({"residual": MOST_APART + 0.001}, "its surfaces lie 0.131 m from those"),
        ({"facing": LEAST_FACING / 2}, "too little stands across some direction"),
        ({"converged": False}, "did not come to rest"),
    ],
)
def test_each_fault_is_told(fault: dict[str, float], reason: str) -> None:
    assert reason in Trust().misfit(replace(GOOD, **fault))


def test_what_is_usual_is_learnt_from_trusted_scans_alone() -> None:
    trust = Trust()
    poor = replace(GOOD, residual=TIMES_THE_USUAL * GOOD.residual + 0.001)
    for _ in range(FEWEST_USUAL):
        trust.remember(poor, trusted=False)
        assert trust.misfit(poor) == ""
    for _ in range(FEWEST_USUAL):
        trust.remember(GOOD, trusted=True)
    assert "where 0.090 m is the most" in trust.misfit(poor)
    assert trust.misfit(replace(GOOD, residual=0.089)) == ""


def test_a_sensor_that_drives_off_is_trusted_though_it_fitted_better_standing() -> None:
    trust = Trust()
    for _ in range(10):
        trust.remember(replace(GOOD, residual=0.001), trusted=True)
    assert trust.misfit(replace(GOOD, residual=WELL_ENOUGH)) == ""
    assert trust.misfit(replace(GOOD, residual=WELL_ENOUGH + 0.01)) != ""


def test_a_motion_is_likely_where_it_is_near_the_last_or_the_last_trusted_one() -> None:
    trust = Trust()
    assert trust.unlikely(motion(5)) == ""  # nothing is known of the speed as yet
    trust.remember(replace(GOOD, motion=motion(1.3)), trusted=True)
    assert trust.unlikely(motion(1.3 + 0.9 * LARGEST_CHANGE)) == ""
    jump = motion(1.3 + 2 * LARGEST_CHANGE)
    assert "1.0 m off what the motion so far leads to" in trust.unlikely(jump)
    trust.remember(replace(GOOD, motion=jump), trusted=False)
    assert trust.unlikely(motion(1.4)) == ""
    assert trust.unlikely(jump) == ""


def test_a_sudden_turn_is_not_likely() -> None:
    trust = Trust()
    assert "a turn by 25 degrees" in trust.unlikely(motion(yaw=LARGEST_TURN + 5))
    trust.remember(GOOD, trusted=True)
    assert trust.unlikely(motion(yaw=9)) == ""
    assert trust.unlikely(motion(yaw=15)) != ""
