"""``derain info`` on folders: scans and points by class and by rain rate."""

import json
from pathlib import Path

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.simulation.manifest import MAKER
from derain.sources.file_frame import FileFrame


@pytest.fixture
def data_set(tmp_path) -> Path:
    """Three sequences of two scans of 100 points: in 000 and 002 it rains, ten drops a scan."""
    root = tmp_path / "data"
    for name in ("000", "001", "002"):
        for stem in ("000000", "000001"):
            scan = root / f"sequences/{name}/lidar_radar_pcd/{stem}.bin"
            scan.parent.mkdir(parents=True, exist_ok=True)
            scene(100).tofile(scan)
            drops = 0 if name == "001" else 10
            label = np.where(np.arange(100) < drops, 3, 7)
            write_labels(root / f"sequences/{name}/lidar_radar_labels/{stem}.label", label)
    rates = {"000": 25.0, "001": 0.0}
    manifest = {"made_by": MAKER, "rain_rate_mm_h": rates}
    (root / "manifest.json").write_text(json.dumps(manifest))
    return root


def some(by_class: dict[str, float]) -> dict[str, float]:
    """What is not 0."""
    return {name: number for name, number in by_class.items() if number}


def test_a_data_set_is_one_object_for_programs(facts_of, data_set) -> None:
    facts = facts_of(data_set)
    assert facts["folder"] == str(data_set)
    assert facts["layout"] == ["lidar_radar_pcd", "lidar_radar_labels"]
    assert facts["card"] == "simulated rain"
    assert (facts["sequences"], facts["scans"], facts["points"]) == (3, 6, 600)
    assert set(facts["class_share"]) == set(load_card("simulated").classes.values())
    assert some(facts["points_by_class"]) == {"rain": 40, "road": 560}
    assert some(facts["class_share"]) == {"rain": 40 / 600, "road": 560 / 600}
    assert list(facts["by_rain_rate"]) == ["0", "25", "unknown"]
    assert facts["by_rain_rate"]["0"]["class_share"]["rain"] == 0
    assert some(facts["by_rain_rate"]["25"]["class_share"]) == {"rain": 0.1, "road": 0.9}


def test_the_table_has_a_line_a_class_and_a_column_a_rate(run_derain, data_set) -> None:
    head, *lines = run_derain("info", data_set).out.splitlines()
    assert str(data_set) in head
    assert "simulated rain" in head
    assert [line.split() for line in lines] == [
        ["all", "share", "clean", "25", "mm/h", "rain", "unknown"],
        ["sequences", "3", "1", "1", "1"],
        ["scans", "6", "2", "2", "2"],
        ["points", "600", "200", "200", "200"],
        ["rain", "40", "6.667%", "0", "20", "20"],
        ["road", "560", "93.333%", "200", "180", "180"],
    ]


def test_units_are_counted_as_one_process_counts_and_not_again(
    run_derain, succeed, data_set, tmp_path, monkeypatch
) -> None:
    table = succeed("info", data_set).out
    assert succeed("info", data_set, "--workers", 2).out == table
    first, last = (
        ("info", data_set, "--out", tmp_path / "counts", "--shard", f"{number}/2")
        for number in (0, 1)
    )
    assert "derain status" in succeed(*first).out
    assert "2 of 3 units done" in run_derain("status", tmp_path / "counts").out
    assert succeed(*last).out == table
    label = data_set / "sequences/001/lidar_radar_labels/000000.label"
    write_labels(label, np.full(100, 7))  # other inputs, the same counts
    with monkeypatch.context() as counted:
        seen: list[str] = []
        count = FileFrame.count_points
        counted.setattr(
            FileFrame, "count_points", lambda frame: seen.append(frame.key) or count(frame)
        )
        assert succeed("info", data_set, "--out", tmp_path / "counts").out == table
    assert seen == ["001/000000", "001/000001"]


def test_a_unit_that_cannot_be_counted_does_not_stop_the_others_of_a_folder_of_records(
    run_derain, succeed, data_set, tmp_path
) -> None:
    scan = data_set / "sequences/000/lidar_radar_pcd/000001.bin"
    content = scan.read_bytes()
    scan.write_bytes(b"broken")
    command = ("info", data_set, "--out", tmp_path / "counts")
    outcome = run_derain(*command)
    assert (outcome.code, outcome.out) == (2, "")
    (error,) = outcome.err.splitlines()  # in one line
    assert str(scan) in error
    assert "1 of 3 units failed" in error
    assert "2 of 3 units done, 1 failed" in run_derain("status", tmp_path / "counts").out
    scan.write_bytes(content)
    assert succeed(*command).out == succeed("info", data_set).out


def test_records_are_of_one_folder_and_are_asked_for(refused, data_set, tmp_path) -> None:
    assert "--out" in refused("info", data_set, data_set, "--out", tmp_path / "counts")
    assert "--out" in refused("info", data_set, "--shard", "0/2")
    assert "--out" in refused("info", data_set, "--anew")


def test_a_card_without_labels_to_explain_is_warned_of(run_derain, tmp_path) -> None:
    (tmp_path / "scans").mkdir()
    scene(50).tofile(tmp_path / "scans/0.bin")
    write_labels(tmp_path / "truth/0.label", np.full(50, 110))
    card = tmp_path / "mine.yaml"
    card.write_text(
        "{name: mine, classes: {110: snow}, rain: [110], layout: {scans: scans, labels: truth}}"
    )
    outcome = run_derain("info", tmp_path / "scans", "--card", "wads")
    assert (outcome.code, outcome.err.count("\n")) == (0, 1)
    assert "layout: {scans: scans, labels: FOLDER}" in outcome.err
    outcome = run_derain("info", tmp_path / "scans", "--card", card)
    assert (outcome.code, outcome.err) == (0, "")
    assert "snow" in outcome.out


def test_the_card_is_named_or_else_chosen_by_the_layout(facts_of, data_set, tmp_path) -> None:
    card = tmp_path / "mine.yaml"
    card.write_text("name: mine\nclasses: {3: wet, 7: grey}\nrain: [3]")
    facts = facts_of(data_set, "--card", card)
    assert (facts["card"], list(facts["class_share"])) == ("mine", ["wet", "grey"])
    (data_set / "manifest.json").unlink()
    assert facts_of(data_set)["card"] == "REHEARSE-3D"


def test_scans_without_labels_and_card_are_counted(succeed, facts_of, tmp_path) -> None:
    scene(100).tofile(tmp_path / "0.bin")
    facts = facts_of(tmp_path)
    assert (facts["scans"], facts["points"], facts["class_share"]) == (1, 100, {})
    assert (facts["layout"], facts["card"]) == (None, None)
    assert "no data card" in succeed("info", tmp_path).out


def test_a_picture_shows_one_folder_alone(refused, data_set, tmp_path) -> None:
    for named in ([__file__], [data_set, data_set], ["--grid", data_set]):
        line = refused("info", *named, "--picture", tmp_path / "statistics.png")
        assert "--picture: shows one folder's statistics" in line


def test_a_card_that_is_not_there_is_one_line(refused, data_set) -> None:
    assert "no such data card" in refused("info", data_set, "--card", "none")


@pytest.mark.parametrize(("rain", "doubted"), [(110, False), (70, True)], ids=["WADS", "KITTI"])
def test_a_card_that_rests_on_common_names_of_folders_is_a_guess(
    succeed, facts_of, tmp_path, rain, doubted
) -> None:
    scan = tmp_path / "sequences/00/velodyne/000000.bin"
    scan.parent.mkdir(parents=True)
    scene(100).tofile(scan)
    write_labels(tmp_path / "sequences/00/labels/000000.label", np.repeat([40, rain], 50))
    head = succeed("info", tmp_path).out.splitlines()[0]
    assert "WADS, guessed" in head
    assert doubted == ("falling-snow" in head) == ("--card" in head)
    assert facts_of(tmp_path)["card_rests_on"] == "names of folders"
    assert "guessed" not in succeed("info", tmp_path, "--card", "wads").out
