"""``derain annotate`` labels the scans of one sequence."""

from pathlib import Path
from textwrap import dedent

import numpy as np
import pytest
from recorded_scenes import write_scenes

from derain.annotation.scene import read_scene
from derain.cli.main import module_of
from derain.evaluation.hard_cases import scene
from derain.files import read_scan, write_scan
from derain.files.labels import read_labels
from derain.fusion import UNKNOWN
from derain.scan import Scan, class_ids
from derain.simulation.classes import TrackClass

SCENE = """
road: [[2, -10], [60, -10], [60, 10], [2, 10]]
boxes:
  wall: {class: background, centre: [40, 0, 2], size: [1, 40, 10]}
corrections:
  "007": {boxes: {wall: {shift: [0, 0, 100]}}}
"""


SEQUENCE = Path("data/sequences/003")
ANNOTATE = ("annotate", SEQUENCE, "--scene", "scene.yaml", "--out")


@pytest.fixture(autouse=True)
def _sequence(here) -> None:
    """A sequence of three scans: a road, a wall and drops."""
    write_scenes(SEQUENCE / "lidar_radar_pcd", *3 * [2000])
    Path("scene.yaml").write_text(SCENE)


def labels(out: Path, points: int = 2000) -> list[np.ndarray]:
    return [class_ids(read_labels(path, points)) for path in sorted(out.glob("*.label"))]


def test_a_sequence_is_labelled_counted_and_drawn(succeed) -> None:
    out = Path("out")
    lines = succeed(*ANNOTATE, out).out.splitlines()
    found = labels(out)
    assert lines[0] == "sequence 003: 3 scans, 6,000 points"
    offset = float(lines[1].split()[1])
    assert offset == pytest.approx(1.8, abs=0.02)
    counts = {line.split()[0]: int(line.split()[1].replace(",", "")) for line in lines[2:-1]}
    assert list(counts) == [*(kind.name.lower() for kind in TrackClass), "unknown"]
    assert counts["rain"] == np.sum(np.array(found) == TrackClass.RAIN)
    assert sum(counts.values()) == 6000
    assert lines[-1] == str(out / "003.png")
    assert sorted(path.name for path in out.iterdir()) == [
        *(f"00000{number}.label" for number in range(3)),
        "003.png",
    ]
    for number, label in enumerate(found):
        xyz = read_scan(SEQUENCE / f"lidar_radar_pcd/{number:06d}.bin").xyz
        aside = np.abs(xyz[:, 1]) > 10.1
        assert (label[aside] == TrackClass.BACKGROUND).all()
        low = (xyz[:, 2] < -1.75) & (np.abs(xyz[:, 1]) < 9.9) & (xyz[:, 0] < 39) & (xyz[:, 0] > 3)
        assert (label[low] == TrackClass.ROAD).mean() > 0.99


def test_corrections_are_those_of_the_sequence_named(succeed) -> None:
    rain = {}
    for name in ("003", "007"):
        succeed(*ANNOTATE, name, "--sequence", name)
        rain[name] = np.sum(np.array(labels(Path(name))) == TrackClass.RAIN)
    assert rain["007"] > rain["003"] + 1000  # nothing keeps the wall from being rain


def test_radar_points_take_the_label_of_the_nearest_point(succeed) -> None:
    points = scene(2000, 1)[::100]
    points[-1] = (500, 0, 0, 0)
    write_scan(Path("radar/000001.bin"), Scan.of(points))
    out = Path("out")
    succeed(*ANNOTATE, out, "--radar", "radar")
    (radar,) = labels(out / "radar", 20)
    assert radar[:-1].tolist() == labels(out)[1][::100][:-1].tolist()
    assert radar[-1] == UNKNOWN


def test_the_scene_file_of_the_help_can_be_read() -> None:
    _, text = (module_of("annotate").__doc__ or "").split("up):\n")
    example, _ = text.split("The classes are")
    Path("scene.yaml").write_text(dedent(example))
    scene = read_scene(Path("scene.yaml"))
    assert set(scene.boxes) == {"car_1", "mast_1"}
    assert scene.rain_area is not None
    assert scene.in_sequence("003").boxes["car_1"].centre == (20.2, 1, -0.6)
    assert all(kind.name.lower() in text for kind in TrackClass)


def test_labels_that_came_with_the_scans_are_not_overwritten(refused) -> None:
    for own in ("lidar_radar_pcd", "lidar_radar_labels", "labels"):
        (SEQUENCE / own).mkdir(exist_ok=True)
        before = sorted(SEQUENCE.rglob("*"))
        refused(*ANNOTATE, SEQUENCE / own)
        assert sorted(SEQUENCE.rglob("*")) == before


def test_a_radar_frame_of_other_columns_is_refused_with_the_option_that_names_them(refused) -> None:
    write_scan(Path("radar/000000.bin"), Scan.of(scene(21)[:, :3]))
    line = refused(*ANNOTATE, "out", "--radar", "radar")
    assert line.startswith("derain: radar/000000.bin: ")
    assert "--radar-columns" in line
    assert " --columns" not in line


def test_a_radar_frame_of_no_scan_is_refused(refused) -> None:
    write_scan(Path("radar/000009.bin"), Scan.of(scene(20)))
    line = refused(*ANNOTATE, "out", "--radar", "radar")
    remedy = "Leave --radar out, and give the labels to `derain fuse --labels`."
    assert f"000009.bin: no scan has its name. {remedy}" in line
    assert not Path("out").exists()
