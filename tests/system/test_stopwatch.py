"""Milliseconds by stage, each moment counted once."""

import time
from contextlib import suppress

from derain.system.stopwatch import Stopwatch


def test_a_stage_within_a_stage_is_not_counted_twice_and_one_that_raises_is_counted(
    monkeypatch,
) -> None:
    seconds, stopwatch = [0.0], Stopwatch()
    monkeypatch.setattr(time, "perf_counter", lambda: seconds[0])
    with stopwatch.stage("view"):
        seconds[0] += 1
        for _ in range(2):
            with stopwatch.stage("read"):
                seconds[0] += 10
        seconds[0] += 2
        with stopwatch.stage("read"), stopwatch.stage("wait"):
            seconds[0] += 100
        with suppress(ZeroDivisionError), stopwatch.stage("read"):
            seconds[0] += 20
            raise ZeroDivisionError
    with stopwatch.stage("view"):
        seconds[0] += 4
    assert stopwatch.milliseconds == {"read": 40_000, "wait": 100_000, "view": 7_000}
