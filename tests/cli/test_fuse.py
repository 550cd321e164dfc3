"""``derain fuse``: folders of two sensors become one, frame by frame, by their clocks."""

import csv
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.files import read_scan
from derain.files.extrinsics import motion_of_pose, moved
from derain.files.labels import instance, read_labels, write_labels
from derain.fusion import UNKNOWN
from derain.scan import class_ids

PLACE = motion_of_pose(0.5, 0, -0.7, 0, 0, 90)
COLUMNS = "x,y,z,doppler,rcs,range,azimuth,elevation,probability,class"

FUSE = [
    *("fuse", "--lidar", "lidar", "--radar", "radar", "--extrinsics", "radar.yaml"),
    *("--out", "out"),
]


def write_times(folder: Path, times: list[float]) -> None:
    lines = [f"{frame},{time}" for frame, time in enumerate(times)]
    (folder / "metadata.csv").write_text("\n".join(["frame,timestamp", *lines]))


def read_rows(file: Path) -> list[dict[str, str]]:
    with file.open() as lines:
        return list(csv.DictReader(lines))


@pytest.fixture(autouse=True)
def _recording(here) -> None:
    """Three LiDAR scans at 10 Hz, five radar frames that start and end between them."""
    for sensor in ("lidar", "radar", "labels"):
        Path(sensor).mkdir()
    for number in range(3):
        scene(40, seed=number).tofile(f"lidar/{number:06d}.bin")
        write_labels(Path(f"labels/{number:06d}.label"), np.arange(40) % 8, np.arange(40))
    for number in range(5):
        scene(12, seed=100 + number).tofile(f"radar/{number:06d}.bin")
    write_times(Path("lidar"), [0.0, 0.1, 0.2])
    write_times(Path("radar"), [-0.03, 0.06, 0.09, 0.12, 0.26])
    Path("radar.yaml").write_text("{x: 0.5, y: 0, z: -0.7, roll: 0, pitch: 0, yaw: 90}")


def test_each_scan_is_joined_by_the_radar_frame_nearest_in_time(succeed) -> None:
    outcome = succeed(*FUSE)
    assert "3 scans in" in outcome.out
    assert "1 of them without a radar frame" in outcome.out
    for number, partner in enumerate([0, 2, None]):
        scan = read_scan(Path(f"out/lidar_radar_pcd/{number:06d}.bin"))
        radar = np.empty((0, 4)) if partner is None else scene(12, seed=100 + partner)
        lidar = scene(40, seed=number)
        np.testing.assert_array_equal(scan.xyz, np.r_[lidar[:, :3], moved(radar[:, :3], PLACE)])
        np.testing.assert_array_equal(scan.intensity, np.r_[lidar[:, 3], radar[:, 3]])
    assert not Path("out/lidar_radar_labels").exists()


def test_the_metadata_name_what_was_joined_to_what(succeed) -> None:
    succeed(*FUSE, "--within", "0.1")
    rows = read_rows(Path("out/lidar_radar_pcd/metadata.csv"))
    assert [row["frame"] for row in rows] == ["000000", "000001", "000002"]
    assert [float(row["timestamp"]) for row in rows] == [0.0, 0.1, 0.2]
    assert [row["radar_frame"] for row in rows] == ["000000", "000002", "000004"]


@pytest.mark.parametrize("reach", [0.01, 1000])
def test_labels_reach_as_far_as_an_option_allows_and_instances_are_kept(succeed, reach) -> None:
    succeed(*FUSE, "--labels", "labels", "--label-within", str(reach))
    raw = read_labels(Path("out/lidar_radar_labels/000001.label"), 40 + 12)
    np.testing.assert_array_equal(class_ids(raw)[:40], np.arange(40) % 8)
    np.testing.assert_array_equal(instance(raw), [*range(40), *[0] * 12])
    np.testing.assert_array_equal(class_ids(raw)[40:] != UNKNOWN, reach == 1000)


def test_real_radar_detections_keep_their_doppler_and_rcs(succeed, shared) -> None:
    detections = np.load(shared / "data/radar/ars548_detections.npy")
    for file in Path("radar").glob("*.bin"):
        file.unlink()
    np.save("radar/000001.npy", detections)
    succeed(*FUSE, "--radar-columns", COLUMNS, "--extra", "doppler,rcs")
    fused = read_scan(Path("out/lidar_radar_pcd/000001.npz"))
    assert list(fused.fields) == ["x", "y", "z", "intensity", "radar", "doppler", "rcs"]
    is_radar = fused.fields["radar"] == 1
    assert is_radar.tolist() == [False] * 40 + [True] * 308
    np.testing.assert_array_equal(fused.fields["doppler"][is_radar], detections[:, 3])
    np.testing.assert_array_equal(fused.fields["rcs"][is_radar], detections[:, 4])


def put_on_another_clock() -> None:
    write_times(Path("radar"), [1.7e9 + frame for frame in range(5)])


@pytest.mark.parametrize(
    ("spoil", "options", "reason"),
    [
        (Path("radar/metadata.csv").unlink, [], "radar/metadata.csv: there is no such file"),
        (put_on_another_clock, [], "radar: no frame is within 0.05 s of a LiDAR scan"),
        (Path("radar.yaml").unlink, [], "radar.yaml: there is no such file"),
        (Path("labels/000002.label").unlink, ["--labels", "labels"], "000002.label: there is no"),
        (Path("lidar/000002.npy").touch, [], "another scan has the same name"),
        (None, ["--extra", "doppler"], "has no column doppler of numbers (x, y, z, intensity)"),
        (None, ["--radar-columns", "x,y,z,doppler,rcs"], "are not whole rows of 20 bytes"),
        (None, ["--lidar-columns", "x,y,z"], "Name the file's columns with --lidar-columns"),
    ],
)
def test_what_cannot_be_fused_is_one_line_and_exit_code_2(refused, spoil, options, reason) -> None:
    if spoil is not None:
        spoil()
    assert reason in refused(*FUSE, *options)
    # Nothing half-written, and no metadata of scans that are not there.
    left = {path.name for path in Path("out").rglob("*") if path.is_file()}
    assert not any(name.startswith(".") or name == "metadata.csv" for name in left)


def test_scans_of_another_format_stay_alone_in_their_folder(refused, succeed) -> None:
    succeed(*FUSE)
    line = refused(*FUSE, "--radar-columns", COLUMNS, "--extra", "doppler")
    assert "is of a run with another --extra" in line
    succeed(*FUSE)
    assert not list(Path("out").rglob("*.npz"))


def test_the_input_is_never_overwritten(refused) -> None:
    Path("lidar").rename("lidar_radar_pcd")
    assert "would overwrite" in refused(*FUSE, "--lidar", "lidar_radar_pcd", "--out", ".")
    assert Path("lidar_radar_pcd/000000.bin").read_bytes() == scene(40).tobytes()
