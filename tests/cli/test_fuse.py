"""``derain fuse``: folders of two sensors become one, frame by frame, as their clocks say."""

import csv
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files import read_scan
from derain.files.extrinsics import Extrinsics
from derain.files.labels import instance, read_labels, semantic, write_labels
from derain.fusion import UNKNOWN
from derain.simulation.campaign import Campaign
from derain.simulation.radar import Radar
from derain.simulation.sequence import write_sequence
from derain.system.open3d_import import import_open3d

PLACE = Extrinsics.of_pose(0.5, 0, -0.7, 0, 0, 90)
COLUMNS = "x,y,z,doppler,rcs,range,azimuth,elevation,probability,class"

Fuse = Callable[..., Any]


def write_times(folder: Path, times: dict[str, float]) -> None:
    lines = [f"{frame},{time}" for frame, time in times.items()]
    (folder / "metadata.csv").write_text("\n".join(["frame,timestamp", *lines]))


def radar_points(seed: int) -> np.ndarray:
    return scene(12, seed=100 + seed)


@pytest.fixture
def recording(tmp_path: Path) -> Path:
    """Three LiDAR scans at 10 Hz, five radar frames that start and end between them."""
    for sensor, points, frames in (("lidar", scene, 3), ("radar", radar_points, 5)):
        (tmp_path / sensor).mkdir()
        for number in range(frames):
            cloud = points(40, seed=number) if sensor == "lidar" else points(number)
            cloud.tofile(tmp_path / sensor / f"{number:06d}.bin")
    write_times(tmp_path / "lidar", {"000000": 0.0, "000001": 0.1, "000002": 0.2})
    write_times(tmp_path / "radar", {"0": -0.03, "1": 0.06, "2": 0.09, "3": 0.12, "4": 0.26})
    (tmp_path / "labels").mkdir()
    for number in range(3):
        label = tmp_path / "labels" / f"{number:06d}.label"
        write_labels(label, np.arange(40) % 8, np.arange(40))
    (tmp_path / "radar.yaml").write_text("{x: 0.5, y: 0, z: -0.7, roll: 0, pitch: 0, yaw: 90}")
    return tmp_path


@pytest.fixture
def run_fuse(run_derain, recording: Path) -> Fuse:
    """Fuses the recording."""

    def run(*options: str | Path) -> Any:
        folders = ["--lidar", recording / "lidar", "--radar", recording / "radar"]
        place = ["--extrinsics", recording / "radar.yaml", "--out", recording / "out"]
        return run_derain("fuse", *folders, *place, *options)

    return run


def test_each_scan_is_joined_by_the_radar_frame_nearest_in_time(
    run_fuse: Fuse, recording: Path
) -> None:
    outcome = run_fuse()
    assert outcome.code == 0, outcome.err
    assert "3 scans in" in outcome.out
    assert "1 of them without a radar frame" in outcome.out
    for number, frame in enumerate([0, 2, None]):
        scan = read_scan(recording / "out/lidar_radar_pcd" / f"{number:06d}.bin")
        lidar = scene(40, seed=number)
        np.testing.assert_array_equal(np.c_[scan.xyz, scan.intensity][:40], lidar)
        if frame is None:
            assert len(scan) == 40
        else:
            radar = radar_points(frame)
            np.testing.assert_array_equal(scan.xyz[40:], PLACE(radar[:, :3]))
            np.testing.assert_array_equal(scan.intensity[40:], radar[:, 3])
    assert not (recording / "out/lidar_radar_labels").exists()


def test_the_metadata_say_what_was_joined_to_what(run_fuse: Fuse, recording: Path) -> None:
    run_fuse("--within", "0.1")
    with (recording / "out/lidar_radar_pcd/metadata.csv").open() as file:
        rows = list(csv.DictReader(file))
    assert [row["frame"] for row in rows] == ["000000", "000001", "000002"]
    assert [float(row["timestamp"]) for row in rows] == [0.0, 0.1, 0.2]
    assert [row["radar_frame"] for row in rows] == ["000000", "000002", "000004"]


def test_labels_reach_as_far_as_is_said_and_instances_are_kept(
    run_fuse: Fuse, recording: Path
) -> None:
    for reach in (0.01, 1000):
        assert run_fuse("--labels", recording / "labels", "--label-within", str(reach)).code == 0
        raw = read_labels(recording / "out/lidar_radar_labels/000001.label", 40 + 12)
        np.testing.assert_array_equal(semantic(raw)[:40], np.arange(40) % 8)
        np.testing.assert_array_equal(instance(raw), [*range(40), *[0] * 12])
        known = semantic(raw)[40:] != UNKNOWN
        assert known.all() if reach == 1000 else not known.any()


def test_real_radar_detections_keep_their_doppler_and_rcs(
    run_fuse: Fuse, recording: Path, shared: Path
) -> None:
    detections = np.load(shared / "data/radar/ars548_detections.npy")
    for file in (recording / "radar").glob("*.bin"):
        file.unlink()
    np.save(recording / "radar/000001.npy", detections)
    outcome = run_fuse("--radar-columns", COLUMNS, "--extra", "doppler,rcs")
    assert outcome.code == 0, outcome.err
    fused = read_scan(recording / "out/lidar_radar_pcd/000001.npz")
    assert list(fused.fields) == ["x", "y", "z", "intensity", "radar", "doppler", "rcs"]
    is_radar = fused.fields["radar"] == 1
    assert is_radar.tolist() == [False] * 40 + [True] * 308
    np.testing.assert_array_equal(fused.fields["doppler"][is_radar], detections[:, 3])
    np.testing.assert_array_equal(fused.fields["rcs"][is_radar], detections[:, 4])
    back = PLACE.inverse(fused.xyz[is_radar])
    np.testing.assert_allclose(back, detections[:, :3], atol=1e-4)


def test_the_simulators_extended_radar_brings_its_velocity_and_cross_section(
    succeed, tmp_path: Path
) -> None:
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    write_sequence(tmp_path, Campaign(scans=1, sensor="mems_64", radar=Radar()), "000")
    succeed(
        *("fuse", "--lidar", tmp_path / "innoviz", "--radar", tmp_path / "ext_radar"),
        *("--extrinsics", tmp_path / "extrinsics.yaml", "--out", tmp_path / "out"),
        *("--extra", "velocity,cross_section", "--within", "0.1"),
    )
    with (tmp_path / "out/lidar_radar_pcd/metadata.csv").open() as file:
        (row,) = csv.DictReader(file)
    with (tmp_path / "ext_radar" / f"{row['radar_frame']}.csv").open() as file:
        detections = list(csv.DictReader(file))
    fused = read_scan(tmp_path / "out/lidar_radar_pcd/000000.npz")
    is_radar = fused.fields["radar"] == 1
    assert is_radar.sum() == len(detections) > 0
    for name in ("velocity", "cross_section"):
        expected = np.float32([float(detection[name]) for detection in detections])
        np.testing.assert_array_equal(fused.fields[name][is_radar], expected)
        assert np.isnan(fused.fields[name][~is_radar]).all()


def test_metadata_columns_can_be_named(run_fuse: Fuse, recording: Path) -> None:
    for sensor in ("lidar", "radar"):
        path = recording / sensor / "metadata.csv"
        path.write_text(path.read_text().replace("frame,timestamp", "stem,seconds"))
    assert run_fuse("--metadata-columns", "stem,seconds").code == 0


def without_metadata(recording: Path) -> None:
    (recording / "radar/metadata.csv").unlink()


def on_another_clock(recording: Path) -> None:
    write_times(recording / "radar", {str(frame): 1.7e9 + frame for frame in range(5)})


def without_a_label(recording: Path) -> None:
    (recording / "labels/000002.label").unlink()


def with_one_name_twice(recording: Path) -> None:
    np.save(recording / "lidar/000002.npy", scene(40))


def without_extrinsics(recording: Path) -> None:
    (recording / "radar.yaml").unlink()


@pytest.mark.parametrize(
    ("spoil", "options", "reason"),
    [
        (without_metadata, [], "radar/metadata.csv: there is no such file. Write one"),
        (on_another_clock, [], "radar: no frame is within 0.05 s of a LiDAR scan"),
        (without_a_label, ["--labels"], "000002.label: there is no such file"),
        (without_extrinsics, [], "radar.yaml: there is no such file"),
        (with_one_name_twice, [], "another scan has the same name"),
        (None, ["--extra", "intensity"], "is a column of the merged cloud itself"),
        (None, ["--extra", "doppler"], "has no column doppler of numbers (x, y, z, intensity)"),
        (None, ["--radar-columns", "x,y,z,doppler,rcs"], "are not whole rows of 20 bytes"),
        (
            None,
            ["--lidar-columns", "x,y,z"],
            "whole rows of 12 bytes (x,y,z). Name the file's columns with --lidar-columns",
        ),
        (None, ["--metadata-columns", "frame,time"], "has no columns frame and time"),
    ],
)
def test_what_cannot_be_fused_is_one_line_and_exit_code_2(
    run_fuse: Fuse,
    recording: Path,
    spoil: Callable[[Path], None] | None,
    options: list[str | Path],
    reason: str,
) -> None:
    if spoil is not None:
        spoil(recording)
    outcome = run_fuse(*options, *([recording / "labels"] if options == ["--labels"] else []))
    assert (outcome.code, outcome.out) == (2, "")
    (line,) = [line for line in outcome.err.splitlines() if line.startswith("derain:")]
    assert reason in line
    # Nothing half-written, and no metadata of scans that are not there.
    left = {path.name for path in (recording / "out").rglob("*") if path.is_file()}
    assert not any(name.startswith(".") or name == "metadata.csv" for name in left)


@pytest.mark.parametrize(
    "options",
    [["--metadata-columns", "frame"], ["--within", "0"], ["--label-within", "-1"]],
    ids=str,
)
def test_what_cannot_be_meant_is_refused_before_any_work(
    run_fuse: Fuse, recording: Path, options: list[str]
) -> None:
    assert run_fuse(*options).code == 2
    assert not (recording / "out").exists()


def test_the_input_is_never_overwritten(refused, recording: Path) -> None:
    (recording / "lidar").rename(recording / "lidar_radar_pcd")
    line = refused(
        *("fuse", "--lidar", recording / "lidar_radar_pcd", "--radar", recording / "radar"),
        *("--extrinsics", recording / "radar.yaml", "--out", recording),
    )
    assert "would overwrite" in line
    assert (recording / "lidar_radar_pcd/000000.bin").read_bytes() == scene(40).tobytes()
