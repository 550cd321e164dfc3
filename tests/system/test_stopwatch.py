"""Milliseconds by stage, each moment counted once."""

import time

import pytest

from derain.system.stopwatch import Stopwatch


@pytest.fixture
def seconds(monkeypatch: pytest.MonkeyPatch) -> list[float]:
    """What the clock says, which stands still unless it is told not to."""
    now = [0.0]
    monkeypatch.setattr(time, "perf_counter", lambda: now[0])
    return now


def test_a_stage_within_a_stage_is_not_counted_twice(seconds: list[float]) -> None:
    stopwatch = Stopwatch()
    with stopwatch.stage("view"):
        seconds[0] += 1
        for _ in range(2):
            with stopwatch.stage("read"):
                seconds[0] += 10
        seconds[0] += 2
        with stopwatch.stage("read"), stopwatch.stage("wait"):
            seconds[0] += 100
    with stopwatch.stage("view"):
        seconds[0] += 4
    assert stopwatch.milliseconds == {"read": 20_000, "wait": 100_000, "view": 7_000}


def test_a_stage_that_raises_is_counted_too(seconds: list[float]) -> None:
    stopwatch = Stopwatch()

    def fail() -> None:
        with stopwatch.stage("read"):
            seconds[0] += 10
            raise ZeroDivisionError

    with stopwatch.stage("view"):
        seconds[0] += 1
        with pytest.raises(ZeroDivisionError):
            fail()
    assert stopwatch.milliseconds == {"read": 10_000, "view": 1_000}
