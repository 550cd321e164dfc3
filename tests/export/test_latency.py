"""The latency report: every stage, its percentiles, and what the times depend on."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import timing
from derain.export.latency import Latency, measure_latency
from derain.export.timing import STAGES, RunTimes


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    path = tmp_path / "scan.bin"
    scene(400).tofile(path)
    return path


def test_every_run_is_timed_by_stage_and_in_total(onnx_model: Path, scan: Path) -> None:
    report = measure_latency(onnx_model, scan, threads=1, repeats=4)
    times = np.array(list(report.times.stages.values()))
    assert times.shape == (len(STAGES), 4)
    assert (times > 0).all()
    table = str(report).splitlines()[2:-1]
    assert [line.split()[0] for line in table] == [*STAGES, "total"]
    assert (report.points, report.threads) == (400, 1)


def test_columns_are_taken_as_stated(onnx_model: Path, tmp_path: Path) -> None:
    wide = np.column_stack([scene(100), np.zeros(100, np.float32)])
    wide.tofile(tmp_path / "wide.bin")
    stated = ["x", "y", "z", "intensity", "ring"]
    assert measure_latency(onnx_model, tmp_path / "wide.bin", stated, repeats=1).points == 100


def test_without_a_scan_a_made_up_one_of_100_000_points_is_timed(
    onnx_model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(timing, "WARM_UP", 0)
    report = measure_latency(onnx_model, repeats=1)
    assert report.points == 100_000


def test_the_report_is_a_table_of_percentiles() -> None:
    times = RunTimes({"read": np.full(101, 2.0), "network": np.arange(101.0)})
    report = Latency(times, 115_881, 2, "a processor; versions")
    assert str(report).splitlines() == [
        "115,881 points, 2 threads, 101 runs, milliseconds",
        "stage         p50      p90      p99",
        "read          2.0      2.0      2.0",
        "network      50.0     90.0     99.0",
        "total        52.0     92.0    101.0",
        "a processor; versions",
    ]


def test_what_cannot_be_read_is_reported(onnx_model: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.bin: there is no such file"):
        measure_latency(onnx_model, tmp_path / "none.bin")
    with pytest.raises(InputError, match=r"none\.onnx: there is no such file"):
        measure_latency(tmp_path / "none.onnx")
