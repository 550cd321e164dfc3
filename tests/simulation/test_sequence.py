"""One sequence: the folders of REHEARSE-3D, and how LiDAR, radar and weather belong together."""

import csv
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.files.extrinsics import moved, read_extrinsics
from derain.files.labels import instance, read_labels
from derain.scan import Float32s, Floats, class_ids
from derain.simulation.campaign import Campaign, Drive
from derain.simulation.classes import TrackClass
from derain.simulation.radar import Radar
from derain.simulation.sensor import load_sensor
from derain.simulation.sequence import write_sequence
from derain.sources.folders import named_frames

FACILITY = {"scans": 3, "sensor": "mems_64", "layout": "facility", "rain_rates": (25.0,)}
DRIVE = {"layout": "street", "rain_rates": (100.0,), "drive": Drive(speed=13, traffic=5)}
OF_LIDAR = {"innoviz", "lidar_radar_pcd", "lidar_radar_labels", "weather"}
OF_RADAR = {"radar_pcd", "ext_radar"}
EXTRINSICS = "extrinsics.yaml"


def table(path: Path) -> dict[str, list[str]]:
    with path.open(newline="") as lines:
        rows = list(csv.DictReader(lines))
    return {name: [row[name] for row in rows] for name in rows[0]}


def times(folder: Path) -> Floats:
    return np.array(table(folder / "metadata.csv")["timestamp"], float)


def points(path: Path) -> Float32s:
    return np.fromfile(path, "<f4").reshape(-1, 4)


def written(folder: Path, **changes: Any) -> Path:
    write_sequence(folder, Campaign(**{**FACILITY, **changes}), "000")
    return folder


@pytest.fixture(scope="module")
def folder(open3d, tmp_path_factory) -> Path:
    return written(tmp_path_factory.mktemp("sequence") / "000", radar=Radar())


@pytest.fixture(scope="module")
def drive(open3d, tmp_path_factory) -> Path:
    return written(tmp_path_factory.mktemp("drive") / "000", **DRIVE)


def test_the_folders_and_files_are_those_of_rehearse_3d(folder) -> None:
    assert {file.name for file in folder.iterdir()} == OF_LIDAR | OF_RADAR | {EXTRINSICS}
    suffixes = {"lidar_radar_labels": "label", "weather": "csv", "ext_radar": "csv"}
    for kind in OF_LIDAR | OF_RADAR:
        frames = table(folder / kind / "metadata.csv")["frame"]
        expected = {f"{frame}.{suffixes.get(kind, 'bin')}" for frame in frames}
        assert {file.name for file in (folder / kind).iterdir()} == expected | {"metadata.csv"}
        assert frames == [f"{number:06d}" for number in range(len(frames))]


def test_without_a_radar_only_its_folders_are_missing(folder, tmp_path) -> None:
    without_radar = written(tmp_path / "000")
    assert {file.name for file in without_radar.iterdir()} == OF_LIDAR
    assert not list(without_radar.rglob("poses.txt"))  # where nothing moves
    for file in (without_radar / "innoviz").iterdir():
        assert file.read_bytes() == (folder / "innoviz" / file.name).read_bytes()
        alone = without_radar / "lidar_radar_pcd" / file.name
        assert alone.read_bytes() == file.read_bytes()


def test_a_merged_cloud_is_the_scan_and_the_radar_frame_nearest_in_time(folder) -> None:
    lidar, radar = times(folder / "innoviz"), times(folder / "radar_pcd")
    assert lidar == pytest.approx([0, 0.1, 0.2])
    assert np.diff(radar) == pytest.approx(1 / 16.5, abs=2e-6)
    assert 0 <= radar[0] <= 1 / 16.5
    assert lidar[-1] <= radar[-1]
    mounting = read_extrinsics(folder / EXTRINSICS)
    below = Radar().mounting_height - load_sensor("mems_64").mounting_height
    assert moved(np.zeros((1, 3)), mounting) == pytest.approx(np.array([[0, 0, below]]))
    for number, time in enumerate(lidar):
        merged = points(folder / f"lidar_radar_pcd/{number:06d}.bin")
        scan = points(folder / f"innoviz/{number:06d}.bin")
        frame = points(folder / f"radar_pcd/{np.abs(radar - time).argmin():06d}.bin")
        assert np.array_equal(merged[: len(scan)], scan)
        assert np.array_equal(merged[len(scan) :, :3], moved(frame[:, :3], mounting))
        assert np.array_equal(merged[len(scan) :, 3], frame[:, 3])
        label = read_labels(folder / f"lidar_radar_labels/{number:06d}.label", len(merged))
        assert set(label) <= set(TrackClass)


def test_the_extended_radar_has_the_same_points_and_what_was_measured_of_them(folder) -> None:
    extended = table(folder / "ext_radar/000001.csv")
    names = ["x", "y", "z", "intensity", "cross_section", "velocity", "confidence"]
    assert list(extended) == names
    columns = {name: np.array(column, float) for name, column in extended.items()}
    stacked = np.stack([columns[name] for name in names[:4]], axis=1)
    assert np.allclose(stacked, points(folder / "radar_pcd/000001.bin"), rtol=1e-4, atol=1e-4)
    # The echo of a given cross-section falls with the fourth power of the distance.
    distance = np.linalg.norm(stacked[:, :3], axis=1)
    loss = columns["cross_section"] - columns["intensity"]
    assert loss == pytest.approx(40 * np.log10(distance / Radar().reach), abs=0.01)
    assert ((columns["confidence"] > 0.9) & (columns["confidence"] <= 1)).mean() > 0.9


def test_the_weather_is_that_of_the_campaign(folder) -> None:
    for frame in table(folder / "weather/metadata.csv")["frame"]:
        weather = table(folder / "weather" / f"{frame}.csv")
        assert weather["rain_rate_mm_h"] == ["25"]
        assert 10 < float(weather["rain_rate_at_sensor_mm_h"][0]) < 50
        assert float(weather["drop_slope_per_mm"][0]) == pytest.approx(2.0855, rel=1e-4)


def test_the_poses_of_a_drive_take_the_road_of_every_scan_to_the_same_place(drive) -> None:
    road: list[Floats] = []
    seen: set[int] = set()
    for kind in ("innoviz", "lidar_radar_pcd"):
        for frame in named_frames([drive / kind]):
            assert frame.time == pytest.approx(0.1 * frame.number)
            scan, pose = frame.read(), frame.pose
            raw = np.fromfile(drive / f"lidar_radar_labels/{frame.number:06d}.label", "<u4")
            assert np.linalg.norm(pose[:3, 3]) == pytest.approx(1.3 * frame.number, abs=0.1)
            world = scan.xyz @ pose[:3, :3].T + pose[:3, 3]
            # A plane, and within 20 m the beams meet it well.
            road.append(world[(class_ids(raw) == TrackClass.ROAD) & (scan.range < 20)])
            moving = instance(raw) > 0
            assert set(class_ids(raw)[moving]) <= {TrackClass.CAR, TrackClass.PEDESTRIAN}
            assert (class_ids(raw) == TrackClass.RAIN).sum() > 50
            seen |= set(instance(raw)[moving])
    middle = road[0].mean(axis=0)
    normal = np.linalg.svd(road[0] - middle, full_matrices=False)[2][2]
    for of_scan in road:
        off = (of_scan - middle) @ normal
        assert len(off) > 500
        assert abs(off.mean()) < 0.003
        assert off.std() < 0.01
    assert len(seen) >= 2
    assert seen <= set(range(1, 6))


def test_the_radar_stands_above_a_tilted_sensor_as_above_a_level_one(folder, tmp_path) -> None:
    tilted = replace(load_sensor("mems_64"), tilt=(4.0, 12.0))
    extrinsics = read_extrinsics(written(tmp_path, sensor=tilted, radar=Radar()) / EXTRINSICS)
    level = read_extrinsics(folder / EXTRINSICS)
    frame = points(folder / "radar_pcd/000000.bin")[:, :3]
    turned = moved(frame, extrinsics) @ tilted.mounting[:3, :3].T
    assert np.allclose(turned, moved(frame, level), atol=1e-4)


def test_poses_of_a_tilted_sensor_are_those_of_a_level_one_in_its_own_frame(
    drive, tmp_path
) -> None:
    tilted = replace(load_sensor("mems_64"), tilt=(3.0, 10.0), rows=2)
    folders = drive, written(tmp_path, **DRIVE, sensor=tilted)
    of_level, of_tilted = (
        np.array([frame.pose for frame in named_frames([folder / "innoviz"])]) for folder in folders
    )
    own = tilted.mounting.T @ of_level @ tilted.mounting
    assert np.allclose(of_tilted, own, atol=1e-8)
    assert np.linalg.norm(own[2, :3, 3]) == pytest.approx(2.6, abs=0.2)
