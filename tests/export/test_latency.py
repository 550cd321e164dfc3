"""The latency report: every stage, its percentiles, and what the times depend on."""

import platform
from pathlib import Path

import numpy as np
import onnxruntime
import pytest

import derain
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import latency
from derain.export.latency import Latency, measure_latency, versions

STAGES = ["read", "view", "network", "back", "total"]


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    path = tmp_path / "scan.bin"
    scene(400).tofile(path)
    return path


def test_every_run_is_timed_by_stage_and_in_total(onnx_model: Path, scan: Path) -> None:
    report = measure_latency(onnx_model, scan, threads=1, repeats=4)
    assert list(report.stages) == STAGES
    times = np.array(list(report.stages.values()))
    assert times.shape == (5, 4)
    assert (times > 0).all()
    np.testing.assert_allclose(times[:-1].sum(axis=0), times[-1])
    assert (report.points, report.threads) == (400, 1)


def test_columns_are_taken_as_stated(onnx_model: Path, tmp_path: Path) -> None:
    wide = np.column_stack([scene(100), np.zeros(100, np.float32)])
    wide.tofile(tmp_path / "wide.bin")
    stated = ["x", "y", "z", "intensity", "ring"]
    assert measure_latency(onnx_model, tmp_path / "wide.bin", stated, repeats=1).points == 100


def test_without_a_scan_a_made_up_one_of_100_000_points_is_timed(
    onnx_model: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(latency, "WARM_UP", 0)
    report = measure_latency(onnx_model, repeats=1)
    assert report.points == 100_000


def test_the_report_is_a_table_of_percentiles() -> None:
    stages = {"read": np.full(101, 2.0), "total": np.arange(101.0)}
    report = Latency(stages, 115_881, 2, "a processor; versions")
    assert str(report).splitlines() == [
        "115,881 points, 2 threads, 101 runs, milliseconds",
        "stage         p50      p90      p99",
        "read          2.0      2.0      2.0",
        "total        50.0     90.0     99.0",
        "a processor; versions",
    ]


def test_the_versions_are_those_that_run() -> None:
    for version in (
        f"derain {derain.__version__}",
        f"onnxruntime {onnxruntime.__version__}",
        f"NumPy {np.__version__}",
        f"Python {platform.python_version()}",
    ):
        assert version in versions()
    assert not versions().startswith(";")


def test_what_cannot_be_read_is_reported(onnx_model: Path, tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"none\.bin: there is no such file"):
        measure_latency(onnx_model, tmp_path / "none.bin")
    with pytest.raises(InputError, match=r"none\.onnx: there is no such file"):
        measure_latency(tmp_path / "none.onnx")
