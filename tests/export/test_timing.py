"""Timed runs: which scans are read, how often and in what order; and the report of them."""

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import timing
from derain.export.timing import (
    STAGES,
    WARM_UP,
    RunTimes,
    measure_latency,
    percentile_table,
    timed_runs,
)
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.system.stopwatch import Stopwatch


class Recorder:
    """A method whose n-th run takes n milliseconds in one stage."""

    def __init__(self) -> None:
        self.points: list[int] = []

    def __call__(self, scan: Scan, stopwatch: Stopwatch) -> None:
        self.points.append(len(scan))
        stopwatch.milliseconds["network"] = len(self.points)


def test_scans_take_turns_after_the_first_has_warmed_up(tmp_path) -> None:
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
    assert np.isnan(RunTimes.of_no_runs().percentile(50))


def test_a_model_is_timed_on_a_file_or_on_a_made_up_scan(onnx_model, tmp_path, monkeypatch) -> None:
    wide = np.column_stack([scene(400), np.zeros(400, np.float32)])
    wide.tofile(tmp_path / "wide.bin")
    stated = ["x", "y", "z", "intensity", "ring"]
    report = measure_latency(onnx_model, tmp_path / "wide.bin", stated, threads=1, repeats=4)
    first, _, *table, last = report.splitlines()
    assert first == "400 points, 1 threads, 4 runs, milliseconds"
    assert [line.split()[0] for line in table] == [*STAGES, "total"]
    assert last == timing.versions()
    monkeypatch.setattr(timing, "WARM_UP", 0)
    assert measure_latency(onnx_model, repeats=1).startswith("100,000 points, ")
    with pytest.raises(InputError, match=r"none\.bin: there is no such file"):
        measure_latency(onnx_model, tmp_path / "none.bin")


def test_the_report_is_a_table_of_percentiles() -> None:
    times = RunTimes({"read": np.full(101, 2.0), "network": np.arange(101.0)})
    table = percentile_table(times).splitlines()
    assert table[0].split() == ["stage", "p50", "p90", "p99"]
    assert table[2].split() == ["network", "50.0", "90.0", "99.0"]
    assert table[3].split() == ["total", "52.0", "92.0", "101.0"]
