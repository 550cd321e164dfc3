"""``derain bench``: from scans to tables and a picture, and the paper's beside ours."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import yaml

from derain.evaluation.hard_cases import scene
from derain.export.bench import bench
from derain.export.runtime import Derainer
from derain.files.labels import write_labels
from derain.simulation.campaign import MAKER

FILES = ["bench.csv", "bench.json", "bench.md", "speed_error.png"]
METHODS = ["dror", "position", "intensity", "all", "none"]
ONCE = ["--timed", "1", "--repeats", "1"]

pytestmark = pytest.mark.usefixtures("in_this_process")


def read_report(folder: Path) -> dict[str, Any]:
    return json.loads((folder / "bench.json").read_text())


@pytest.fixture
def root(tmp_path, write_labelled) -> Path:
    """A simulated data set: one training, one validation and three test sequences."""
    root = tmp_path / "set"
    for number in range(5):
        folder = root / f"sequences/00{number}"
        label = folder / "lidar_radar_labels/0.label"
        write_labelled(folder / "lidar_radar_pcd/0.bin", label, rain=3)
    manifest = {
        "made_by": MAKER,
        "split": {"train": ["000"], "validation": ["001"], "test": ["002", "003", "004"]},
        "rain_rate_mm_h": {"000": 25, "001": 25, "002": 10, "003": 25, "004": 50},
    }
    (root / "manifest.json").write_text(json.dumps(manifest))
    return root


def test_every_method_and_baseline_stands_in_one_table(succeed, root, tmp_path, onnx_model) -> None:
    out = tmp_path / "out"
    outcome = succeed(
        "bench", "--data", root, "--methods", onnx_model, *METHODS, *ONCE, "--out", out
    )
    assert sorted(path.name for path in out.iterdir()) == FILES
    content = read_report(out)
    rows = {row["method"]: row for row in content["rows"]}
    assert list(rows) == ["outdet", *METHODS]
    assert all(0 <= row["iou"] <= 1 and row["ms"] > 0 for row in rows.values())
    assert rows["all"]["recall"] == 1
    assert rows["all"]["counts"] == {
        "true_positive": 90,
        "false_positive": 810,
        "false_negative": 0,
        "true_negative": 0,
    }
    assert list(rows["dror"]["by_rain_rate"]) == ["10 mm/h", "25 mm/h", "50 mm/h"]
    assert content["simulated"] is True
    assert "Simulated data" in (out / "bench.md").read_text()
    assert [Path(file["scan"]).parts[-3] for file in content["files"]] == ["002", "003", "004"]
    assert all(f"| {name} " in outcome.out for name in rows)


def test_units_are_scored_as_one_process_scores_and_warned_of_alike(
    run_derain, succeed, root, tmp_path, onnx_model
) -> None:
    for path in root.rglob("*.bin"):
        points = np.fromfile(path, np.float32).reshape(-1, 4)
        (points / np.array([1, 1, 1, 256], np.float32)).tofile(path)
    methods = ["--methods", onnx_model, "ssr", "dror", "position", "all"]
    arguments = ["bench", "--data", root, *methods, *ONCE, "--threads", 2, "--out"]
    one = run_derain(*arguments, tmp_path / "one")
    two = run_derain(*arguments, tmp_path / "two", "--workers", 2, "--block", 2)
    assert one.messages == two.messages != []
    first = run_derain(*arguments, tmp_path / "shards", "--block", 2, "--shard", "0/2")
    assert (first.code, "derain status" in first.out, first.messages) == (0, True, [])
    assert "2 of 3 units done" in run_derain("status", tmp_path / "shards").out
    last = run_derain(*arguments, tmp_path / "shards", "--block", 2, "--shard", "1/2")
    assert one.messages == last.messages
    assert report(tmp_path / "two") == report(tmp_path / "one") == report(tmp_path / "shards")


def report(folder: Path) -> dict[str, Any]:
    """What a bench found and measured, without the name of its folder, times and memory."""
    found = read_report(folder)
    found["command"] = found["command"].replace(str(folder), "")
    costs = ("ms", "stages", "peak_memory")
    for row in found["rows"]:
        for name in [name for name in row if name.startswith(costs)]:
            del row[name]
    return found


def test_a_bench_that_goes_on_scores_no_unit_again_and_refuses_other_methods(
    succeed, refused, root, tmp_path, monkeypatch
) -> None:
    arguments = ["bench", "--data", root, *ONCE, "--resume", "--out", tmp_path, "--methods"]
    succeed(*arguments, "dror", "position")
    assert "method ror" in refused(*arguments, "ror", "position")
    label = root / "sequences/000/lidar_radar_labels/0.label"
    write_labels(label, np.zeros(300, np.int64))  # from which position learns
    assert "method position" in refused(*arguments, "dror", "position")
    with monkeypatch.context() as nothing:
        nothing.delattr(bench, "score")
        succeed(*arguments, "dror", "position", "--train", root / "sequences/001/lidar_radar_pcd")


@pytest.fixture
def knowing(root, onnx_model, changed_model) -> Path:
    """A model that was trained on the validation scans and two of the test scans."""
    spec = Derainer(onnx_model).metadata["spec"]
    trained = {"data": "simulated rain", "training": {"sequences": ["001", "002", "003"]}}
    return changed_model({"spec": {**spec, **trained}})


def test_a_model_that_knows_the_scans_from_its_training_is_named(
    succeed, root, tmp_path, onnx_model, knowing
) -> None:
    out = tmp_path / "out"
    methods = [f"knowing={knowing}", f"other={onnx_model}", "all"]
    outcome = succeed("bench", "--data", root, "--methods", *methods, *ONCE, "--out", out)
    (warning,) = [line for line in outcome.err.splitlines() if "warning" in line]
    assert warning.startswith("derain: warning: knowing was trained on 2 of these 3 scans, such as")
    assert str(root / "sequences/002/lidar_radar_pcd/0.bin") in warning
    (note,) = read_report(out)["notes"]
    assert warning == f"derain: warning: {note}"
    assert note in (out / "bench.md").read_text()


def test_a_threshold_tuned_on_training_scans_is_warned_of(succeed, root, tmp_path, knowing) -> None:
    outcome = succeed("tune", knowing, "--data", root, "--out", tmp_path / "tuned.yaml")
    assert "was trained on 1 of these 1 scans" in outcome.err


def test_the_command_in_the_report_makes_the_same_figures_again(succeed, root, tmp_path) -> None:
    options = ["--limit", "2", "--seed", "3", *ONCE]
    first, again = tmp_path / "first", tmp_path / "again"
    succeed("bench", "--data", root, "--methods", "t=dsor", "all", *options, "--out", first)
    derain, *words = read_report(first)["command"].split()
    words[words.index("--out") + 1] = str(again)
    assert derain == "derain"
    succeed(*words)
    assert report(again) == report(first)
    assert len(report(again)["files"]) == 2


def test_baselines_learn_nothing_from_points_that_may_be_rain_or_not(succeed, tmp_path) -> None:
    # In the voxel at 1 m all that is known is rain; were the unknown taken for dry, it would not
    # be, and neither would the dim be. At 5 m all is known.
    x = np.repeat([1.0, 1.0, 5.0], [4, 40, 40])
    intensity = np.repeat([1.0, 1.0, 9.0], [4, 40, 40])
    np.stack([x, x * 0, x * 0, intensity], axis=1).astype("<f4").tofile(tmp_path / "scan.bin")
    write_labels(tmp_path / "scan.label", np.repeat([1, 2, 0], [4, 40, 40]))
    card = {"name": "ours", "classes": {0: "dry", 1: "rain", 2: "haze"}, "rain": [1]}
    (tmp_path / "card.yaml").write_text(yaml.safe_dump({**card, "unknown": [2]}))
    data = ["--data", tmp_path / "scan.bin", "--train", tmp_path / "scan.bin"]
    options = ["--card", tmp_path / "card.yaml", "--methods", "position", "intensity", *ONCE]
    succeed("bench", *data, *options, "--out", tmp_path)
    for row in read_report(tmp_path)["rows"]:
        assert list(row["counts"].values()) == [4, 0, 0, 40], row["method"]


def test_points_that_a_scan_holds_twice_are_counted_once_if_its_card_says_so(
    succeed, tmp_path
) -> None:
    rows = np.random.default_rng(0).permutation(np.resize(np.arange(300), 420))
    scene(300)[rows].tofile(tmp_path / "scan.bin")
    write_labels(tmp_path / "scan.label", np.where(rows >= 240, 110, 40))
    options = ["--data", tmp_path / "scan.bin", "--card", "wads", "--methods", "all", *ONCE]
    succeed("bench", *options, "--out", tmp_path)
    assert list(read_report(tmp_path)["rows"][0]["counts"].values()) == [60, 240, 0, 0]
    assert "# WADS, 1 scan, 300 points" in (tmp_path / "bench.md").read_text()


def test_table_2_stands_beside_ours_for_each_part(succeed, root, tmp_path) -> None:
    out = tmp_path / "out"
    data = ["--paper", "table2", "--data", root, "--card", "rehearse3d"]
    outcome = succeed("bench", *data, "--methods", "dsor", *ONCE, "--out", out)
    assert outcome.out == (out / "table2.md").read_text()
    for part in ("validation", "test"):
        assert sorted(path.name for path in (out / part).iterdir()) == FILES
        (section,) = [s for s in outcome.out.split("\n## ") if s.startswith(part)]
        ours = read_report(out / part)["rows"][0]["iou"]
        assert f"{100 * ours:.2f}" in section


def test_table_3_takes_the_rain_rates_of_a_file(succeed, root, tmp_path) -> None:
    rates = tmp_path / "rates.yaml"
    rates.write_text(yaml.safe_dump({"002": 50, "003": 25}))
    out = tmp_path / "out"
    data = ["--paper", "table3", "--data", root, "--rain-rates", rates]
    succeed("bench", *data, "--methods", "dsor", *ONCE, "--out", out)
    assert {path.name for path in out.iterdir()} == {"heavy", "medium", "table3.md"}


def test_rain_rates_of_other_sequences_are_refused(refused, succeed, root, tmp_path) -> None:
    rates = tmp_path / "rates.yaml"
    rates.write_text('"099": 25')
    command = ["bench", "--data", root, "--rain-rates", rates, "--methods", "all", *ONCE]
    line = refused(*command, "--out", tmp_path / "out")
    assert (
        'rates.yaml: names no sequence of these scans. Name them by their folders, as "002"' in line
    )
    rates.write_text('"099": 25\n"002": 25')  # those of a whole data set may be more
    succeed(*command, "--out", tmp_path / "out")


def test_the_papers_tables_need_a_data_set_with_a_split(refused, root, tmp_path) -> None:
    scans = root / "sequences/002/lidar_radar_pcd"
    data = ["--paper", "table2", "--data", scans, "--card", "rehearse3d"]
    line = refused("bench", *data, "--methods", "all", "--out", tmp_path / "out")
    assert "has no split, which the paper's tables need. Name the root." in line


def test_a_seed_that_there_is_not_is_refused(refused, root, tmp_path) -> None:
    data = ("bench", "--data", root, "--methods", "all", "--out", tmp_path / "out")
    assert "--seed: -1 is less than 0" in refused(*data, "--seed", "-1")


def test_a_folder_that_cannot_be_written_is_refused_before_any_work(
    refused, root, monkeypatch
) -> None:
    monkeypatch.delattr(bench, "score")
    out = root / "manifest.json"
    line = refused("bench", "--data", root, "--methods", "all", "--out", out)
    assert "manifest.json: cannot be written" in line


def test_a_bench_that_is_refused_leaves_no_folder(refused, root, tmp_path) -> None:
    refused(
        "bench", "--data", root, "--methods", "all", "--columns", "x,y", "--out", tmp_path / "out"
    )
    assert not (tmp_path / "out").exists()
