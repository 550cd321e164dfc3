"""What is counted is the data card's to say: the same in ``derain test`` and ``derain bench``."""

import json
from pathlib import Path

import numpy as np
import pytest
import yaml

from derain.evaluation.hard_cases import scene
from derain.export.bench import bench
from derain.export.bench.cost import measure_in_process
from derain.files.labels import write_labels


@pytest.fixture(autouse=True)
def in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(bench, "measure_cost", measure_in_process)


@pytest.mark.parametrize(
    ("test_options", "bench_options", "points"),
    [
        ([], [], 300),
        (["--data.loading.batch_size", "4"], ["--distinct"], 300),
        (["--data.loading.deduplicate", "false"], ["--no-distinct"], 420),
    ],
    ids=["as the card says", "named", "not"],
)
def test_points_that_a_scan_holds_twice_are_counted_alike(
    succeed,
    wads: list[str],
    tmp_path: Path,
    checkpoint: Path,
    onnx_model: Path,
    test_options: list[str],
    bench_options: list[str],
    points: int,
) -> None:
    rows = np.random.default_rng(0).permutation(np.resize(np.arange(300), 420))
    scan = tmp_path / "WADS/sequences/02/velodyne/0.bin"
    scene(300)[rows].tofile(scan)
    write_labels(scan.parent.parent / "labels/0.label", np.where(rows >= 240, 110, 40))

    succeed("test", *wads, "--ckpt_path", checkpoint, *test_options)
    (report,) = (json.loads(path.read_text()) for path in tmp_path.rglob("test.json"))
    options = ["--data", scan, "--card", "wads", "--methods", onnx_model, *bench_options]
    succeed("bench", *options, "--timed", "1", "--repeats", "1", "--out", "bench")
    (row,) = json.loads(Path("bench/bench.json").read_text())["rows"]

    assert sum(row["counts"].values()) == points
    command = json.loads(Path("bench/bench.json").read_text())["command"]
    assert ("--no-distinct" in command) == ("--no-distinct" in bench_options)
    classes = report["classes"]
    assert sum(counts["points"] for counts in classes.values()) == points
    snow = classes["falling-snow"]
    found, lost = row["counts"]["true_positive"], row["counts"]["false_positive"]
    assert (snow["called_rain"], snow["points"]) == (found, found + row["counts"]["false_negative"])
    assert sum(counts["called_rain"] for counts in classes.values()) == found + lost
    assert found > 0 < lost
    assert report["scores"]["iou"] == pytest.approx(row["iou"])


def test_baselines_learn_nothing_from_points_that_may_be_rain_or_not(
    succeed, tmp_path: Path
) -> None:
    # In the voxel at 1 m all that is known is rain; were the unknown taken for dry, it would not
    # be, and neither would the dim be. At 5 m all is known.
    x = np.repeat([1.0, 1.0, 5.0], [4, 40, 40])
    label = np.repeat([1, 2, 0], [4, 40, 40])
    intensity = np.repeat([1.0, 1.0, 9.0], [4, 40, 40])
    points = np.stack([x, x * 0, x * 0, intensity], axis=1).astype("<f4")
    points.tofile("scan.bin")
    write_labels(Path("scan.label"), label)
    card = {"name": "ours", "classes": {0: "dry", 1: "rain", 2: "haze"}}
    Path("card.yaml").write_text(yaml.safe_dump({**card, "rain": [1], "unknown": [2]}))
    options = ["--data", "scan.bin", "--train", "scan.bin", "--card", "card.yaml"]
    succeed("bench", *options, "--methods", "position", "intensity", "--out", "bench")
    for row in json.loads(Path("bench/bench.json").read_text())["rows"]:
        assert row["counts"] == {
            "true_positive": 4,
            "false_positive": 0,
            "false_negative": 0,
            "true_negative": 40,
        }, row["method"]
