"""What ``derain status`` adds up: counts, and the weather of each hour."""

import numpy as np
import pytest

from derain.jobs.unit import Record
from derain.sources.cleaned_scan import CleanedTotals, packed
from derain.weather.rays import RANGE_BINS, RAY_SECTORS
from derain.weather.scan_weather import ScanWeather


def weather(drops: int) -> ScanWeather:
    """Of a thousand rays that end at 20 m, and of drops at 5 m."""
    ends = np.zeros((2, RAY_SECTORS, RANGE_BINS), np.int64)
    ends[0, 0, 40], ends[1, 0, 10] = 1000, drops
    return ScanWeather(ends)


def record(unit: str, *scans: tuple[float | None, int]) -> Record:
    """The record of a unit, of scans by their times and drops."""
    results = [
        {
            "cleaned": {"points": 1000 + drops, "valid": 1000, "rain": drops},
            "seconds": seconds,
            "measured": packed(weather(drops)),
        }
        for seconds, drops in scans
    ]
    return Record(unit, "", "", "", 1.0, [], results)


@pytest.mark.parametrize(
    ("unit", "seconds", "named"),
    [
        ("000000", None, "without times"),
        ("a/b/000000", 7300.0, "a/b, hour 2"),
        ("a/000000", 1_700_000_000.0, "2023-11-14 22:00 UTC"),
        ("a/000000", 1.7e18, "a, without times in seconds"),
        ("a/000000", float("nan"), "a, without times"),
    ],
)
def test_hours_are_named_by_their_date_or_recording(unit, seconds, named) -> None:
    totals = CleanedTotals()
    totals.add(record(unit, (seconds, 50)))
    assert list(totals.by_hour) == [named]


def test_scans_are_added_up_and_the_worst_hour_comes_first() -> None:
    totals = CleanedTotals()
    totals.add(record("a/0", (0.0, 10), (10.0, 20), (3700.0, 400)))
    totals.add(record("b/0", (0.0, 100)))
    assert (totals.scans, totals.points, totals.rain) == (4, 4530, 530)
    assert [hour for hour, _ in totals.worst_hours(2)] == ["a, hour 1", "b, hour 0"]
    assert totals.by_hour["a, hour 0"].rays == 2030
