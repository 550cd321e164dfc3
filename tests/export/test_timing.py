"""Timed runs: which scans are read, how often, in what order, and what is kept."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.timing import STAGES, WARM_UP, RunTimes, timed_runs
from derain.scan import Scan
from derain.sources.file_frame import FileFrame
from derain.sources.folders import named_frames
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
    times = timed_runs(method, named_frames(scans), repeats=2)
    assert method.points == [30] * WARM_UP + [30, 40, 30, 40]
    stages = times.stages
    assert tuple(stages) == STAGES
    first = WARM_UP + 1
    np.testing.assert_array_equal(stages["network"], np.arange(first, first + 4))
    np.testing.assert_array_equal([stages["view"], stages["back"]], np.zeros((2, 4)))
    assert (stages["read"] > 0).all()


def test_percentiles_are_of_one_stage_or_of_each_run_as_a_whole() -> None:
    times = RunTimes({"read": np.array([1.0, 5.0, 3.0]), "back": np.array([4.0, 0.0, 2.0])})
    assert times.percentile(50, "read") == 3
    assert times.percentile(50) == 5  # not that of one stage and that of the other
    assert times.percentile(100, "back") == 4


def test_times_of_no_runs_are_not_known() -> None:
    times = RunTimes.of_no_runs()
    assert np.isnan([times.percentile(50), *(times.percentile(95, s) for s in STAGES)]).all()


def test_a_scan_that_cannot_be_read_is_reported(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.bin: there is no such file"):
        timed_runs(Recorder(), [FileFrame(key="none", path=tmp_path / "none.bin")], repeats=1)
