"""``derain simulate``: data sets of simulated rain, and rain on clean scans."""

import json
import re
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray
from recorded_scenes import write_scenes

from derain.evaluation.hard_cases import scene
from derain.files.labels import read_labels
from derain.scan import Float32s

pytestmark = pytest.mark.usefixtures("open3d")

QUICK = ["--sensor", "mems_64", "--workers", "1", "--sequences", "3", "--scans", "1"]


@pytest.fixture
def clean(tmp_path) -> Path:
    """A folder of two clean scans of a room, 5,000 and 6,000 points."""
    return write_scenes(tmp_path / "clean", 5000, 6000)


def names(folder: Path) -> list[str]:
    return sorted(file.name for file in folder.iterdir())


def test_a_data_set_is_written_and_written_once(succeed, refused, facts_of, tmp_path) -> None:
    root = tmp_path / "facility"
    outcome = succeed("simulate", "--out", root, *QUICK)
    assert outcome.out.split(".")[0] == f"{root}: 3 sequences, 3 scans"
    assert names(root) == [".derain", "manifest.json", "sequences"]
    assert names(root / "sequences") == ["000", "001", "002"]
    assert (root / "sequences/000/ext_radar").is_dir()
    manifest = (root / "manifest.json").read_text()
    assert json.loads(manifest)["rain_rate_mm_h"] == {"000": 10, "001": 0, "002": 25}

    facts = facts_of(root)
    assert facts["scans"] == 3
    assert facts["class_share"]["rain"] > 0.01

    succeed("simulate", "--out", root, *QUICK)
    line = refused("simulate", "--out", root, *QUICK, "--seed", "1")
    assert f"{root}: holds a simulated data set of other parameters: campaign.seed was 0" in line
    assert (root / "manifest.json").read_text() == manifest


def test_shards_are_counted_by_the_status(succeed, run_derain, tmp_path) -> None:
    root = tmp_path / "facility"
    command = ("simulate", "--out", root, *QUICK)
    assert f"derain status {root}" in succeed(*command, "--shard", "1/2").out
    assert run_derain("status", root).out.startswith("1 of 3 units done, 0 failed, 2 missing")
    assert f"{root}: 3 sequences, 3 scans" in succeed(*command).out


def test_a_drive_goes_along_a_street_in_the_rain_of_its_options_without_a_radar(
    succeed, facts_of, tmp_path
) -> None:
    root = tmp_path / "drive"
    options = ["--layout", "street", "--speed", "13", "--traffic", "2", "--rain", "50"]
    succeed("simulate", "--out", root, *QUICK, *options)
    campaign = json.loads((root / "manifest.json").read_text())["campaign"]
    assert campaign["drive"] == {"speed": 13, "traffic": 2, "skew": False}
    assert campaign["radar"] is None
    assert (root / "sequences/000/lidar_radar_pcd/poses.txt").is_file()
    assert (root / "sequences/002/weather/000000.csv").read_text().splitlines()[1].startswith("50,")
    assert facts_of(root)["class_share"]["car"] > 0.01


def rained(folder: Path, stem: str, columns: int = 4) -> tuple[Float32s, NDArray]:
    points = np.fromfile(folder / f"{stem}.bin", "<f4").reshape(-1, columns)
    return points, read_labels(folder / f"{stem}.label", len(points))


def test_clean_scans_get_rain_and_labels_of_it(succeed, clean, tmp_path) -> None:
    out = tmp_path / "rainy"
    outcome = succeed("simulate", "--on", clean, "--rain", "50", "--out", out)
    assert names(out) == ["000000.bin", "000000.label", "000001.bin", "000001.label"]
    for line, count in zip(outcome.out.splitlines(), (5000, 6000), strict=True):
        scan, _, text = line.partition(": ")
        points, label = rained(out, Path(scan).stem)
        numbers = re.findall(r"\d+", text.replace(",", ""))
        before, after, drops, lost = map(int, numbers)
        assert before == count
        assert len(points) == after == count - lost + drops
        assert set(label) == {0, 1}
        assert label.sum() == drops > 0


def test_a_line_holds_what_the_rain_did_to_a_scan_and_a_bad_scan_is_reported(
    run_derain, clean, tmp_path
) -> None:
    scan, bad = clean / "000000.bin", clean / "cut.bin"
    bad.write_bytes(b"12345")
    outcome = run_derain("simulate", "--on", bad, scan, "--rain", "0", "--out", tmp_path / "rainy")
    assert outcome.code == 2
    assert outcome.out == f"{scan}: 5,000 points, in the rain 5,000: 0 of drops, 0 lost\n"
    first, last = outcome.err.splitlines()
    assert first.startswith(f"derain: {bad}: 5 bytes are not whole rows of 16 bytes")
    assert "1 of 2 scans" in last


def test_columns_and_a_picture(succeed, tmp_path, saved_figures) -> None:
    points = np.column_stack([scene(3000), np.arange(3000, dtype=np.float32) % 32])
    points.astype("<f4").tofile(tmp_path / "scan.bin")
    arguments = ["--columns", "x,y,z,intensity,ring", "--picture", "--rain", "50"]
    succeed("simulate", "--on", tmp_path / "scan.bin", *arguments, "--out", tmp_path / "o")
    assert names(tmp_path / "o") == ["scan.bin", "scan.label", "scan.png"]
    rainy, label = rained(tmp_path / "o", "scan", columns=5)
    assert set(rainy[:, 4]) <= set(range(32))
    assert label.any()
    (figure,) = saved_figures
    assert figure.get_suptitle() == "scan in 50 mm/h of simulated rain, and without its drops"


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        (["--speed", "13"], "drive: a facility has none"),
        (
            ["--speed", "13", "--layout", "street", "--radar"],
            "drive: has no radar",
        ),
        (["--speed", "13", "--on", "."], "--speed: works only without --on"),
        (["--rain", "-1"], "rain: nominal: -1.0 is impossible. Give 0 to 2,000."),
        (["--rain", "nan"], "--rain: nan is not a number."),
        (["--seed", "-1"], "--seed: -1 is less than 0"),
        (["--sensor", "mars"], "mars: no such sensor. Give a YAML file or one of front_128,"),
        (["--picture"], "--picture: works only with --on. Leave it out."),
        (["--on", "x.bin"], "--rain: scans take a single rain rate. Give one, e.g. --rain 25."),
        (["--on", "x.bin", "--rain", "1", "2"], "--rain: scans take a single rain rate."),
        (["--on", "x.bin", "--rain", "3"], "x.bin: there is no such file or folder. Check"),
        (["--world", "--rain", "3"], "--rain: works only without --world"),
    ],
)
def test_what_cannot_be_meant_is_refused_before_anything_is_written(
    refused, tmp_path, arguments, message
) -> None:
    line = refused("simulate", "--out", tmp_path / "out", *arguments)
    assert line.startswith(f"derain: {message}")
    assert not (tmp_path / "out").exists()


def test_an_output_that_cannot_be_written_is_one_line_for_all_scans(
    refused, clean, tmp_path
) -> None:
    (tmp_path / "file").touch()
    line = refused("simulate", "--on", clean, "--rain", "9", "--out", tmp_path / "file/below")
    assert "file/below: cannot be written" in line
