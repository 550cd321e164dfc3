"""Timed runs: which scans are read, how often, in what order, and what is kept."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.timing import STAGES, timed_runs
from derain.files import DEFAULT_COLUMNS
from derain.scan import Scan
from derain.system.stopwatch import Stopwatch


class Recorder:
    """A method whose n-th run takes n milliseconds in one stage."""

    def __init__(self) -> None:
        self.points: list[int] = []

    def __call__(self, scan: Scan, stopwatch: Stopwatch) -> None:
        self.points.append(len(scan))
        stopwatch.milliseconds["network"] = len(self.points)


def test_scans_take_turns_after_the_first_has_warmed_up(tmp_path: Path) -> None:
    scans = [tmp_path / f"{points}.bin" for points in (30, 40)]
    for path in scans:
        scene(int(path.stem)).tofile(path)
    method = Recorder()
    times = timed_runs(method, scans, DEFAULT_COLUMNS, warm_up=3, repeats=2)
    assert method.points == [30, 30, 30, 30, 40, 30, 40]
    assert tuple(times) == STAGES
    np.testing.assert_array_equal(times["network"], [4, 5, 6, 7])
    np.testing.assert_array_equal([times["view"], times["back"]], np.zeros((2, 4)))
    assert (times["read"] > 0).all()


def test_a_scan_that_cannot_be_read_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.bin: there is no such file"):
        timed_runs(Recorder(), [tmp_path / "none.bin"], DEFAULT_COLUMNS, warm_up=1, repeats=1)
