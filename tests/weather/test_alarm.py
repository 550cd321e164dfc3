"""The alarm holds its level against noise, never falls for worse, and starts by what it sees."""

import math

import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.errors import InputError
from derain.weather.alarm import Alarm, Level, Threshold
from derain.weather.visibility import NOT_KNOWN, Visibility


def seen(metres: float) -> Visibility:
    return Visibility(metres, metres, metres)


def over(metres: float) -> Visibility:
    return Visibility(None, metres, math.inf)


def levels(alarm: Alarm, *visibilities: Visibility) -> list[Level]:
    return [alarm.update(each) for each in visibilities]


ranges = st.lists(st.floats(0, 80), max_size=40)
holds = st.integers(1, 6)


@given(st.lists(st.tuples(st.floats(0, 80), st.floats(0, 80)), max_size=60), holds)
def test_worse_visibility_never_has_a_lower_level(pairs, hold) -> None:
    worse = levels(Alarm(hold=hold), *(seen(min(pair)) for pair in pairs))
    better = levels(Alarm(hold=hold), *(seen(max(pair)) for pair in pairs))
    assert all(one >= other for one, other in zip(worse, better, strict=True))


@given(ranges, st.lists(st.booleans(), min_size=40, max_size=40), holds)
def test_scans_of_which_nothing_is_known_change_nothing(metres, gaps, hold) -> None:
    without = levels(Alarm(hold=hold), *map(seen, metres))
    alarm, found = Alarm(hold=hold), []
    for each, gap in zip(metres, gaps, strict=False):
        if gap:
            before = alarm.level
            assert alarm.update(NOT_KNOWN) == before
        found.append(alarm.update(seen(each)))
    assert found == without


@given(ranges, st.floats(0, 80), holds)
def test_what_stays_long_enough_decides_whatever_was_before(metres, last, hold) -> None:
    if 15 <= last < 20 or 30 <= last < 40:  # it may stay as it was
        return
    alarm = Alarm(hold=hold)
    found = levels(alarm, *map(seen, metres), *[seen(last)] * hold)
    assert found[-1] == (last < 15) + (last < 30)


def test_a_level_waits_for_so_many_scans_in_a_row_and_stays_within_the_gap() -> None:
    alarm = Alarm(hold=3)
    far, near, gap = seen(100), seen(25), seen(35)
    found = levels(alarm, far, near, near, far, near, near, near, far, far, gap, far, far, far)
    assert "".join(str(level)[0] for level in found) == "ccccccwwwwwwc"
    assert levels(alarm, gap, gap, gap) == [Level.CLEAR] * 3


def test_the_first_scan_decides_alone() -> None:
    assert Alarm().level == Level.CLEAR
    assert levels(Alarm(hold=5), NOT_KNOWN, seen(5), seen(5)) == [0, 2, 2]
    assert levels(Alarm(hold=5), seen(22), seen(5)) == [1, 1]
    assert levels(Alarm(hold=5), seen(500), seen(5)) == [0, 0]


def test_an_alarm_changes_only_where_the_whole_interval_lies_beyond_a_threshold() -> None:
    # Of 36 m or any more, whether the warning is over is open.
    farther_than_seen = (seen(25), over(36), over(40), over(20))
    assert levels(Alarm(hold=1), *farther_than_seen) == [1, 1, 0, 0]
    few_rays = Visibility(13.6, 9.0, 41.0)
    others = (Visibility(13.6, 9.0, farthest) for farthest in (29.0, 14.9))
    assert levels(Alarm(hold=1), few_rays, *others, few_rays) == [0, 1, 2, 2]


def test_the_level_of_one_scan_is_the_worst_that_is_certain() -> None:
    alarm = Alarm()
    levels(alarm, *[seen(5.0)] * 9)
    for interval, level in {
        (9.0, 14.0): Level.ERROR,
        (9.0, 29.0): Level.WARNING,
        (9.0, 31.0): None,
        (30.0, 31.0): Level.CLEAR,
        (30.0, math.inf): Level.CLEAR,
        (0.0, math.inf): None,
    }.items():
        assert alarm.level_of(Visibility(None, *interval)) == level


@pytest.mark.parametrize(
    ("dry", "reach", "level"),
    [
        (None, 22.0, Level.CLEAR),  # as in a small room
        (80.0, 70.0, Level.CLEAR),
        (80.0, 22.0, Level.WARNING),
        (80.0, 12.0, Level.ERROR),
        (25.0, 22.0, Level.CLEAR),  # the place is as small when dry
        (25.0, 12.0, Level.ERROR),
        (18.0, 12.0, Level.CLEAR),
    ],
)
def test_range_that_a_dry_scan_reaches_and_this_one_does_not_counts_like_rain(
    dry, reach, level
) -> None:
    reference = None if dry is None else seen(dry)
    for visibility in (over(1000), seen(100)):
        assert Alarm(dry=reference).update(visibility, seen(reach)) == level
        assert Alarm(dry=reference).level_of(visibility, seen(reach)) == level
    assert Alarm(dry=reference).level_of(seen(5), seen(reach)) == Level.ERROR


def test_thresholds_rise_an_error_lies_below_the_warning_and_scans_to_hold_are_whole() -> None:
    for below, above in ((0, 5), (-1, 5), (5, 5), (6, 5), (5, math.inf), (math.nan, 5)):
        with pytest.raises(InputError, match="Give two numbers of metres"):
            Threshold(below, above)
    for error in (Threshold(30, 35), Threshold(20, 40), Threshold(50, 60)):
        with pytest.raises(InputError, match="does not lie below the warning"):
            Alarm(error=error)
    for hold in (0, -1, 1.5, True):
        with pytest.raises(InputError, match=r"hold is .* Give a whole number of 1 or more"):
            Alarm(hold=hold)
