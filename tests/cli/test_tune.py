"""``derain tune``: parameters that run and bench take, and a study that goes on."""

import shlex
import shutil
from pathlib import Path

import numpy as np
import pytest
import yaml

from derain.export.bench.bench_entries import bench_entries
from derain.export.methods import read_parameters
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import read_labels
from derain.filters import FilterDerainer, filter_from


@pytest.fixture
def data(tmp_path: Path, write_labelled) -> list[str | Path]:
    """Options for three labelled scans."""
    for number in range(3):
        write_labelled(
            tmp_path / f"velodyne/{number}.bin", tmp_path / f"labels/{number}.label", rain=110
        )
    return ["--data", tmp_path / "velodyne", "--card", "wads"]


def test_run_takes_what_tune_wrote(
    run_derain, succeed, data: list[str | Path], tmp_path: Path
) -> None:
    best = tmp_path / "best.yaml"
    outcome = succeed("tune", "dsor", *data, "--trials", "5", "--out", best)
    assert outcome.out.startswith("dsor: IoU 0.")
    command = best.read_text().splitlines()[0].partition(": derain ")[2]
    assert f"tune dsor --data {tmp_path / 'velodyne'} --part validation --card wads" in command
    again = run_derain(*shlex.split(command), "--out", tmp_path / "again.yaml")
    assert again.out == outcome.out
    method, parameters = read_parameters(best)
    assert method == "dsor"
    filter_from(method, parameters)
    scans = tmp_path / "velodyne"
    succeed("run", "dsor", scans, "--out", tmp_path / "o", "--parameters", best)


def test_run_and_bench_keep_to_the_candidates_that_tune_fitted(
    run_derain, succeed, data: list[str | Path], tmp_path: Path
) -> None:
    best = tmp_path / "best.yaml"
    options = ["--trials", "3", "--candidates", "0.9", "--out", best]
    outcome = succeed("tune", "dror", *data, *options)
    method, parameters = read_parameters(best)
    candidates = parameters.pop("candidates")
    assert f"candidates: {candidates}" in outcome.out.splitlines()
    scans = [read_scan(path) for path in sorted((tmp_path / "velodyne").iterdir())]
    drops = [candidates.among(scan)[270:].mean() for scan in scans]
    assert np.mean(drops) >= 0.9
    assert run_derain("run", best, tmp_path / "velodyne", "--out", tmp_path / "o").code == 0
    unbounded = FilterDerainer(filter_from(method, parameters))
    called = []
    for number, scan in enumerate(scans):
        expected = unbounded(scan) & candidates.among(scan)
        np.testing.assert_array_equal(read_labels(tmp_path / f"o/{number}.label", 300), expected)
        called.append(expected)
    rain = np.tile(np.arange(300) >= 270, 3)
    iou = np.count_nonzero(np.concatenate(called) & rain) / np.count_nonzero(
        np.concatenate(called) | rain
    )
    assert f"dror: IoU {iou:.4f} " in outcome.out
    benched = succeed(
        *("bench", *data, "--part", "validation", "--methods", best, "--out", tmp_path / "bench"),
        *("--repeats", "1"),
    )
    assert f" {iou:.3f} |" in benched.out


def test_a_model_has_candidates_of_its_own(
    refused, data: list[str | Path], tmp_path: Path, onnx_model: Path
) -> None:
    line = refused("tune", onnx_model, *data, "--candidates", "--out", tmp_path / "b.yaml")
    assert line == ("derain: --candidates: a model has its own. Give it to `derain export`.")


def test_the_threshold_of_a_model_is_tuned(
    run_derain, data: list[str | Path], tmp_path: Path, onnx_model: Path
) -> None:
    best = tmp_path / "best.yaml"
    assert run_derain("tune", onnx_model, *data, "--out", best).code == 0
    method, parameters = read_parameters(best)
    assert Path(method).samefile(onnx_model)
    derainer = Derainer(onnx_model, 1)
    scans = [read_scan(path) for path in sorted((tmp_path / "velodyne").iterdir())]
    probability = np.concatenate([derainer.probability(scan) for scan in scans])
    rain = np.tile(np.arange(300) >= 270, 3)

    def iou(threshold: float) -> float:
        called = probability > threshold
        return np.count_nonzero(called & rain) / np.count_nonzero(called | rain)

    assert iou(parameters["threshold"]) == max(map(iou, [0, *probability]))


def test_points_outside_the_grid_of_a_model_are_warned_of(
    run_derain, data: list[str | Path], tmp_path: Path, salsanext_onnx: Path
) -> None:
    outsides = []
    for path in sorted((tmp_path / "velodyne").iterdir()):
        points = np.fromfile(path, np.float32).reshape(-1, 4)
        points[:100, 2] = 80.0
        points.tofile(path)
        outsides.append((Derainer(salsanext_onnx).view.grid.pixel(points[:, :3]) < 0).mean())
    outcome = run_derain("tune", salsanext_onnx, *data, "--out", tmp_path / "best.yaml")
    assert outcome.said == [
        f"derain: warning: {tmp_path / 'velodyne/0.bin'}: {outsides[0]:.0%} of the points lie "
        "outside the grid of WADS, and stay",
        "derain: warning: 2 more scans: points outside the grid",
    ]


def test_a_tuned_model_is_found_from_any_folder(
    run_derain,
    data: list[str | Path],
    tmp_path: Path,
    onnx_model: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    (tmp_path / "models/tuned").mkdir(parents=True)
    shutil.copy(onnx_model, tmp_path / "models/outdet.onnx")
    monkeypatch.chdir(tmp_path)
    best = "models/tuned/best.yaml"
    assert run_derain("tune", "models/outdet.onnx", *data, "--out", best).code == 0
    assert yaml.safe_load(Path(best).read_text())["method"] == "../outdet.onnx"
    # With its model it may go wherever it likes.
    Path("models").rename("elsewhere")
    (tmp_path / "here").mkdir()
    monkeypatch.chdir("here")
    best = "../elsewhere/tuned/best.yaml"
    scan = tmp_path / "velodyne/0.bin"
    assert run_derain("run", best, scan, "--out", "out").code == 0
    _, parameters = read_parameters(best)
    probability = Derainer(onnx_model).probability(read_scan(scan))
    rain = np.fromfile("out/0.label", "<u4") == 1
    np.testing.assert_array_equal(rain, probability > parameters["threshold"])
    model = "../elsewhere/outdet.onnx"
    assert not run_derain("run", model, scan, "--out", "too", "--parameters", best).code
    (bench_entry,) = bench_entries([best])
    assert bench_entry.facts["threshold"] == parameters["threshold"]


def test_a_model_that_is_not_beside_its_parameters_is_sought_as_written(
    tmp_path: Path, onnx_model: Path
) -> None:
    parameters = tmp_path / "best.yaml"
    parameters.write_text(f"method: {onnx_model}\nthreshold: 0.5\n")
    assert read_parameters(parameters)[0] == str(onnx_model)
    (tmp_path / "dsor").touch()  # no model, though it lies there
    parameters.write_text("method: dsor\n")
    assert read_parameters(parameters)[0] == "dsor"


def test_intensities_of_another_unit_are_warned_of_and_scaled(
    run_derain, data: list[str | Path], tmp_path: Path
) -> None:
    options = ["--trials", "12", "--out", tmp_path / "best.yaml"]
    whole = run_derain("tune", "ssr", *data, *options)
    assert whole.said == []
    for path in (tmp_path / "velodyne").iterdir():
        points = np.fromfile(path, np.float32).reshape(-1, 4)
        (points / np.array([1, 1, 1, 256], np.float32)).tofile(path)
    outcome = run_derain("tune", "ssr", *data, *options)
    assert outcome.said == [
        f"derain: warning: {tmp_path / 'velodyne/0.bin'}: intensities of 0..1, but 0..255 for "
        "ssr: see --intensity-scale or Scan.with_intensity_times",
        "derain: warning: 2 more scans: intensity of a smaller unit",
    ]
    scaled = run_derain("tune", "ssr", *data, *options, "--intensity-scale", "256")
    assert scaled.said == []
    assert scaled.out == whole.out != outcome.out


def test_a_second_call_goes_on_and_comes_to_the_same(
    run_derain, data: list[str | Path], tmp_path: Path
) -> None:
    options = [*data, "--storage", tmp_path / "study.db"]
    for trials in ("3", "6", "6"):
        out = tmp_path / f"{trials}.yaml"
        assert run_derain("tune", "ror", *options, "--trials", trials, "--out", out).code == 0
    other = run_derain("tune", "ror", *options, "--scans", "1", "--out", tmp_path / "no.yaml")
    assert other.code == 2
    assert (
        "holds a study of ror on other scans, labels or candidates. Name another --storage."
        in other.err
    )
    assert not (tmp_path / "no.yaml").exists()


def test_the_scans_are_drawn_by_the_seed(
    run_derain, data: list[str | Path], tmp_path: Path
) -> None:
    def tuned(name: str, seed: int) -> dict:
        out = tmp_path / name
        options = ["--scans", "1", "--trials", "1", "--seed", seed, "--out", out]
        assert run_derain("tune", "dror", *data, *map(str, options)).code == 0
        return yaml.safe_load(out.read_text()), out.read_text().splitlines()[1]

    assert tuned("a.yaml", 1) == tuned("b.yaml", 1)
    assert len({tuned(f"{seed}.yaml", seed)[1] for seed in range(1, 5)}) > 1


@pytest.mark.parametrize(
    ("method", "reason"),
    [
        ("absent.onnx", "absent.onnx: no such file"),
        ("dzor", "dzor: no such file. Did you mean dsor?"),
    ],
)
def test_a_method_that_is_not_there_is_refused(
    refused, data: list[str | Path], tmp_path: Path, method: str, reason: str
) -> None:
    assert reason in refused("tune", method, *data, "--out", tmp_path / "out.yaml")


def test_scans_without_rain_are_refused(refused, tmp_path: Path, write_labelled) -> None:
    write_labelled(tmp_path / "a.bin", tmp_path / "a.label", rain=111)
    data = ["--data", tmp_path / "a.bin", "--card", "wads", "--out", tmp_path / "out.yaml"]
    assert "no point of these scans is falling-snow" in refused("tune", "dsor", *data)
    assert not (tmp_path / "out.yaml").exists()


def test_tuning_on_real_snow_finds_better_parameters(succeed, shared: Path, tmp_path: Path) -> None:
    scan = shared / "data/wads/sample.bin"
    options = ["--data", scan, "--card", "wads", "--trials", "40", "--out", tmp_path / "best.yaml"]
    outcome = succeed("tune", "dsor", *options)
    words = outcome.out.splitlines()[0].split()
    tuned, default = float(words[2]), float(words[8])
    assert default == pytest.approx(0.626, abs=0.003)
    assert tuned > default


def test_what_cannot_be_written_is_refused_before_any_work(
    refused, data: list[str | Path], tmp_path: Path
) -> None:
    storage = tmp_path / "study.db"
    out = tmp_path / "velodyne/0.bin/no.yaml"
    line = refused("tune", "dsor", *data, "--storage", storage, "--out", out)
    assert "no.yaml: cannot be written" in line
    assert not storage.exists()
