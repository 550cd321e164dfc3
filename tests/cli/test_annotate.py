"""``derain annotate`` labels the scans of one sequence."""

import json
from collections.abc import Callable
from pathlib import Path
from textwrap import dedent
from typing import Any

import numpy as np
import pytest

from derain.annotation.scene import read_scene
from derain.cli.main import module_of
from derain.evaluation.hard_cases import scene
from derain.files import read_scan, write_scan
from derain.files.labels import read_labels, semantic
from derain.fusion import UNKNOWN
from derain.scan import Scan
from derain.simulation.classes import TrackClass

SCENE = """
road: [[2, -10], [60, -10], [60, 10], [2, 10]]
boxes:
  wall: {class: background, centre: [40, 0, 2], size: [1, 40, 10]}
corrections:
  "007": {boxes: {wall: {shift: [0, 0, 100]}}}
"""


@pytest.fixture
def sequence(tmp_path) -> Path:
    """A sequence of three scans: a road, a wall and drops, and its labels by another hand."""
    folder = tmp_path / "data" / "sequences" / "003"
    for number in range(3):
        write_scan(folder / f"lidar_radar_pcd/{number:06d}.bin", Scan.of(scene(2000, number)))
    (tmp_path / "scene.yaml").write_text(SCENE)
    return folder


@pytest.fixture
def annotate(succeed, tmp_path, sequence) -> Callable[..., Any]:
    """Labels the sequence."""

    def run(out: Path, *options: str | Path) -> Any:
        command = ["annotate", sequence, "--scene", tmp_path / "scene.yaml", "--out", out]
        return succeed(*command, *options)

    return run


def labels(out: Path, points: int = 2000) -> list[np.ndarray]:
    return [semantic(read_labels(path, points)) for path in sorted(out.glob("*.label"))]


def test_a_sequence_is_labelled_counted_and_drawn(annotate, tmp_path, sequence) -> None:
    out = tmp_path / "out"
    outcome = annotate(out, "--json")
    report = json.loads(outcome.out)
    found = labels(out)
    assert (report["sequence"], report["scans"], report["points"]) == ("003", 3, 6000)
    assert report["points_by_class"]["rain"] == np.sum(np.array(found) == TrackClass.RAIN)
    assert report["plane"]["offset"] == pytest.approx(1.8, abs=0.02)
    assert report["picture"] == str(out / "003.png")
    assert sorted(path.name for path in out.iterdir()) == [
        *(f"00000{number}.label" for number in range(3)),
        "003.png",
    ]
    for number, label in enumerate(found):
        xyz = read_scan(sequence / f"lidar_radar_pcd/{number:06d}.bin").xyz
        aside = np.abs(xyz[:, 1]) > 10.1
        assert (label[aside] == TrackClass.BACKGROUND).all()
        low = (xyz[:, 2] < -1.75) & (np.abs(xyz[:, 1]) < 9.9) & (xyz[:, 0] < 39) & (xyz[:, 0] > 3)
        assert (label[low] == TrackClass.ROAD).mean() > 0.99


def test_the_text_holds_the_plane_and_the_points_by_class(annotate, tmp_path) -> None:
    lines = annotate(tmp_path / "out", "--no-picture").out.splitlines()
    assert lines[0] == "sequence 003: 3 scans, 6,000 points"
    assert lines[1].startswith("road: 1.")
    counts = {line.split()[0]: line.split()[1] for line in lines[2:]}
    assert list(counts) == [*(kind.name.lower() for kind in TrackClass), "unknown"]
    assert sum(int(count.replace(",", "")) for count in counts.values()) == 6000
    assert not list((tmp_path / "out").glob("*.png"))


def test_corrections_are_those_of_the_sequence_named(annotate, tmp_path) -> None:
    rain = {}
    for name in ("003", "007"):
        annotate(tmp_path / name, "--no-picture", "--sequence", name)
        rain[name] = np.sum(np.array(labels(tmp_path / name)) == TrackClass.RAIN)
    assert rain["007"] > rain["003"] + 1000  # nothing keeps the wall from being rain


def test_radar_points_take_the_label_of_the_nearest_point(annotate, tmp_path) -> None:
    points = scene(2000, 1)[::100]
    points[-1] = (500, 0, 0, 0)
    write_scan(tmp_path / "radar/000001.bin", Scan.of(points))
    out = tmp_path / "out"
    annotate(out, "--no-picture", "--radar", tmp_path / "radar")
    (radar,) = labels(out / "radar", 20)
    assert radar[:-1].tolist() == labels(out)[1][::100][:-1].tolist()
    assert radar[-1] == UNKNOWN


def test_the_scene_file_of_the_help_can_be_read(tmp_path) -> None:
    _, text = (module_of("annotate").__doc__ or "").split("up):\n")
    example, _ = text.split("The classes are")
    (tmp_path / "scene.yaml").write_text(dedent(example))
    scene = read_scene(tmp_path / "scene.yaml")
    assert set(scene.boxes) == {"car_1", "mast_1"}
    assert scene.rain_area is not None
    assert scene.in_sequence("003").boxes["car_1"].centre == (20.2, 1, -0.6)
    assert all(kind.name.lower() in text for kind in TrackClass)


def test_labels_that_came_with_the_scans_are_not_overwritten(refused, tmp_path, sequence) -> None:
    for own in ("lidar_radar_pcd", "lidar_radar_labels", "labels"):
        (sequence / own).mkdir(exist_ok=True)
        before = sorted(sequence.rglob("*"))
        refused("annotate", sequence, "--scene", tmp_path / "scene.yaml", "--out", sequence / own)
        assert sorted(sequence.rglob("*")) == before


def test_a_radar_frame_of_no_scan_is_refused(refused, tmp_path, sequence) -> None:
    write_scan(tmp_path / "radar/000009.bin", Scan.of(scene(20)))
    arguments = ["--scene", tmp_path / "scene.yaml", "--out", tmp_path / "out"]
    line = refused("annotate", sequence, *arguments, "--radar", tmp_path / "radar")
    assert "000009.bin: no scan has its name" in line
    assert not (tmp_path / "out").exists()
