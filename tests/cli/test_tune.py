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

RAIN = np.tile(np.arange(300) >= 270, 3)  # of the three scans


@pytest.fixture(autouse=True)
def _scans(here, write_labelled) -> None:
    """Three labelled scans in the working folder."""
    for number in range(3):
        write_labelled(Path(f"velodyne/{number}.bin"), Path(f"labels/{number}.label"), rain=110)


DATA = ["--data", "velodyne", "--card", "wads"]
BEST = Path("best.yaml")


def files() -> list[Path]:
    return sorted(Path("velodyne").iterdir())


def iou_of(called: np.ndarray) -> float:
    return np.count_nonzero(called & RAIN) / np.count_nonzero(called | RAIN)


def test_run_takes_what_tune_wrote(run_derain, succeed) -> None:
    outcome = succeed("tune", "dsor", *DATA, "--trials", "5", "--out", BEST)
    assert outcome.out.startswith("dsor: IoU 0.")
    default = FilterDerainer(filter_from("dsor", {}))
    iou = iou_of(np.concatenate([default(read_scan(path)) for path in files()]))
    assert f"{iou:.4f} with the defaults" in outcome.out
    command = BEST.read_text().splitlines()[0].partition(": derain ")[2]
    assert "tune dsor --data velodyne --part validation --card wads" in command
    again = run_derain(*shlex.split(command), "--out", "again.yaml")
    assert again.out == outcome.out
    method, parameters = read_parameters(BEST)
    assert method == "dsor"
    filter_from(method, parameters)
    succeed("run", "dsor", "velodyne", "--out", "o", "--parameters", BEST)


def test_run_and_bench_keep_to_the_candidates_that_tune_fitted(succeed) -> None:
    outcome = succeed("tune", "dror", *DATA, "--trials", "3", "--candidates", "0.9", "--out", BEST)
    method, parameters = read_parameters(BEST)
    candidates = parameters.pop("candidates")
    assert f"candidates: {candidates}" in outcome.out.splitlines()
    scans = [read_scan(path) for path in files()]
    inside = np.concatenate([candidates.among(scan) for scan in scans])
    assert inside[RAIN].mean() >= 0.9
    succeed("run", BEST, "velodyne", "--out", "o")
    unbounded = FilterDerainer(filter_from(method, parameters))
    called = np.concatenate([unbounded(scan) for scan in scans]) & inside
    written = [read_labels(Path(f"o/{number}.label"), 300) for number in range(3)]
    np.testing.assert_array_equal(np.concatenate(written), called)
    assert f"dror: IoU {iou_of(called):.4f} " in outcome.out
    validation = ["--part", "validation", "--repeats", "1"]
    benched = succeed("bench", *DATA, *validation, "--methods", BEST, "--out", "bench")
    assert f" {iou_of(called):.3f} |" in benched.out


def test_a_model_has_candidates_of_its_own(refused, onnx_model) -> None:
    line = refused("tune", onnx_model, *DATA, "--candidates", "--out", BEST)
    assert line == "derain: --candidates: a model has its own. Give it to `derain export`."


def test_the_threshold_of_a_model_is_tuned(succeed, onnx_model) -> None:
    succeed("tune", onnx_model, *DATA, "--out", BEST)
    method, parameters = read_parameters(BEST)
    assert Path(method).samefile(onnx_model)
    derainer = Derainer(onnx_model, 1)
    probability = np.concatenate([derainer.probability(read_scan(path)) for path in files()])
    found = iou_of(probability > parameters["threshold"])
    assert found == max(iou_of(probability > threshold) for threshold in (0, *probability))


def test_a_tuned_model_is_found_from_any_folder(succeed, here, onnx_model, monkeypatch) -> None:
    Path("models/tuned").mkdir(parents=True)
    shutil.copy(onnx_model, "models/outdet.onnx")
    succeed("tune", "models/outdet.onnx", *DATA, "--out", "models/tuned/best.yaml")
    # With its model it may go wherever it likes.
    Path("models").rename("elsewhere")
    Path("sub").mkdir()
    monkeypatch.chdir("sub")
    best = "../elsewhere/tuned/best.yaml"
    assert yaml.safe_load(Path(best).read_text())["method"] == "../outdet.onnx"
    scan = here / "velodyne/0.bin"
    succeed("run", best, scan, "--out", "out")
    _, parameters = read_parameters(best)
    probability = Derainer(onnx_model).probability(read_scan(scan))
    rain = np.fromfile("out/0.label", "<u4") == 1
    np.testing.assert_array_equal(rain, probability > parameters["threshold"])
    model = "../elsewhere/outdet.onnx"
    succeed("run", model, scan, "--out", "too", "--parameters", best)
    (bench_entry,) = bench_entries([best])
    assert bench_entry.facts["threshold"] == parameters["threshold"]


def test_a_model_that_is_not_beside_its_parameters_is_sought_as_written(onnx_model) -> None:
    BEST.write_text(f"method: {onnx_model}\nthreshold: 0.5\n")
    assert read_parameters(BEST)[0] == str(onnx_model)
    Path("dsor").touch()  # no model, though it lies there
    BEST.write_text("method: dsor\n")
    assert read_parameters(BEST)[0] == "dsor"


def test_the_scans_are_drawn_by_the_seed(succeed) -> None:
    def tuned(seed: int) -> str:
        options = ["--scans", "1", "--trials", "1", "--seed", str(seed)]
        succeed("tune", "dsor", *DATA, *options, "--out", BEST)
        return BEST.read_text().split("\n", 1)[1]  # but for the command

    assert tuned(1) == tuned(1)
    assert len({tuned(seed) for seed in (2, 3, 4, 2**32)}) > 1


def test_scans_without_rain_are_refused(refused, write_labelled) -> None:
    write_labelled(Path("a.bin"), Path("a.label"), rain=111)
    line = refused("tune", "dsor", "--data", "a.bin", "--card", "wads", "--out", BEST)
    assert "no point of these scans is falling-snow" in line
    assert not BEST.exists()


def test_tuning_on_real_snow_finds_better_parameters(succeed, shared) -> None:
    data = ["--data", shared / "data/wads/sample.bin", "--card", "wads"]
    outcome = succeed("tune", "dsor", *data, "--trials", "20", "--out", BEST)
    words = outcome.out.splitlines()[0].split()
    tuned, default = float(words[2]), float(words[8])
    assert tuned > default


def test_what_cannot_be_written_is_refused_before_any_work(refused) -> None:
    out = "velodyne/0.bin/no.yaml"
    line = refused("tune", "dsor", *DATA, "--storage", "study.db", "--out", out)
    assert "no.yaml: cannot be written" in line
    assert not Path("study.db").exists()


@pytest.mark.parametrize(
    ("place", "named"),
    [
        ("postgresql://me:secret@localhost:1/trials", "***@localhost:1/trials"),
        ("postgresql+nodriver://me:secret@localhost/trials", "nodriver"),
        ("postgresql://me:secret@localhost:port/trials", "address of a database"),
        ("sqlite:///missing/study.db", "cannot be used as storage"),
        ("missing/study.journal", "cannot be used as storage"),
        ("velodyne/0.journal", "cannot be used as storage"),
    ],
)
def test_a_storage_that_cannot_be_used_is_refused_in_one_line(refused, place, named) -> None:
    shutil.copy("velodyne/0.bin", "velodyne/0.journal")
    line = refused("tune", "dsor", *DATA, "--storage", place, "--out", BEST)
    assert named in line
    assert "secret" not in line
    assert not BEST.exists()


def test_no_password_is_written(succeed, onnx_model) -> None:
    storage = ["--storage", "postgresql://me:secret@localhost/trials?password=secret"]
    succeed("tune", onnx_model, *DATA, *storage, "--out", BEST)  # which needs no storage
    assert "postgresql://me:***@localhost/trials?password=***" in BEST.read_text()
    assert "secret" not in BEST.read_text()
