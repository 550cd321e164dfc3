"""``derain odometry``: scans in, poses out, with a warning for each that is not to be trusted."""

import re
from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_scenes

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.sources.folders import named_frames
from derain.sources.trajectory import read_trajectory
from derain.workflows import odometry

STEP = np.array([0.9, 0.05, 0.0])


def write_recording(folder: Path, scans: int, step: np.ndarray = STEP) -> Path:
    """Scans of one scene, each of them a step further on."""
    folder.mkdir(parents=True)
    for number in range(scans):
        points = scene(6000)
        noise = np.random.default_rng(number).normal(0, 0.02, (6000, 3))
        points[:, :3] += noise - number * step
        points.tofile(folder / f"{number:06d}.bin")
    return folder


@pytest.fixture
def recording(tmp_path) -> Path:
    return write_recording(tmp_path / "hall/velodyne", 4)


@pytest.fixture
def apart(tmp_path) -> Path:
    """A recording of scans that have nothing in common."""
    return write_scenes(tmp_path / "apart/velodyne", *3 * [300], name="{}.bin")


def test_poses_are_written_and_found_beside_the_scans(run_derain, recording) -> None:
    out = recording.parent / "poses.txt"
    outcome = run_derain("odometry", recording, "--out", out)
    assert (outcome.code, outcome.err) == (0, "")
    *lines, summary = outcome.out.splitlines()
    assert [line.split(": ")[0] for line in lines] == list(map(str, sorted(recording.iterdir())))
    assert re.search(r"0\.9\d m, 0\.\d\d deg, residual 0\.0\d\d m, 100% matched", lines[2])
    assert re.search(
        r"4 scans, path 2\.7 m, 0\.90 m a scan; residual median 0\.0\d+ m, worst", summary
    )
    assert summary.endswith("; 0 not to be trusted")
    for number, frame in enumerate(named_frames([recording])):
        np.testing.assert_allclose(frame.pose[:3, 3], number * STEP, atol=0.05)
    assert {path.name for path in recording.parent.iterdir()} == {"velodyne", "poses.txt"}


def test_one_scan_has_the_identity_and_a_note(succeed, recording, tmp_path) -> None:
    out = tmp_path / "poses.txt"
    outcome = succeed("odometry", recording / "000000.bin", "--out", out)
    assert "1 scan shows no motion" in outcome.out
    np.testing.assert_array_equal(read_trajectory(out).poses, np.eye(4)[None])


def test_scans_that_fail_are_named_and_the_rest_is_done(run_derain, recording, tmp_path) -> None:
    (recording / "000001.bin").write_bytes(b"damaged")
    (recording / "000004.bin").symlink_to(recording / "000000.bin")
    out = tmp_path / "poses.txt"
    outcome = run_derain("odometry", recording, "--out", out)
    assert outcome.code == 2
    damaged, after, back, end = outcome.err.splitlines()
    assert damaged.startswith(f"derain: {recording / '000001.bin'}: ")
    assert after.startswith(f"derain: warning: {recording / '000002.bin'}: not to be trusted: the ")
    assert "000004.bin: not to be trusted: " in back
    assert "out of order or far apart" in back
    assert end == "derain: 3 of 5 scans could not be registered"
    assert "3 not to be trusted" in outcome.out.splitlines()[-1]
    poses = read_trajectory(out).poses
    assert len(poses) == 5
    np.testing.assert_allclose(np.linalg.inv(poses[2])[:3] @ poses[3][:, 3], STEP, atol=0.05)


def test_several_recordings_are_a_folder_of_files_but_of_those_that_fail(
    run_derain, recording, apart, tmp_path
) -> None:
    other = write_recording(tmp_path / "other/velodyne", 2, -STEP)
    out = tmp_path / "poses"
    outcome = run_derain("odometry", apart, recording, other, "--out", out)
    assert outcome.code == 2
    assert "apart.txt: was not written: no two scans" in outcome.err
    assert "hall.txt: 4 scans" in outcome.out
    assert {path.name for path in out.iterdir()} == {"hall.txt", "other.txt"}
    found = read_trajectory(out / "other.txt").poses
    np.testing.assert_allclose(found[1, :3, 3], -STEP, atol=0.05)


def test_poses_that_cannot_be_written_are_named_in_the_exit_code(
    run_derain, recording, tmp_path, monkeypatch
) -> None:
    def full(*_: object) -> None:
        raise InputError(tmp_path / "poses.txt", "cannot be written (full)", "Make room.")

    monkeypatch.setattr(odometry, "_write", full)
    outcome = run_derain("odometry", recording, "--out", tmp_path / "poses.txt")
    assert outcome.code == 2
    assert "poses.txt: cannot be written (full)" in outcome.err


def test_recordings_of_one_name_are_refused(refused, recording, tmp_path) -> None:
    namesake = write_recording(tmp_path / "other/hall/velodyne", 1)
    line = refused("odometry", recording, namesake, "--out", tmp_path / "twice")
    assert "another recording is called hall too" in line
    assert not (tmp_path / "twice/hall.txt").exists()


@pytest.mark.parametrize("name", ["poses.txt", "calib.txt", "velodyne/000001.bin"])
def test_what_exists_is_not_overwritten(refused, recording, name) -> None:
    out = recording.parent / name
    if not out.exists():
        out.write_text("precious")
    before = out.read_bytes()
    assert f"{out}: exists" in refused("odometry", recording, "--out", out)
    assert out.read_bytes() == before


def test_poses_are_replaced_on_request(succeed, recording) -> None:
    out = recording.parent / "poses.txt"
    out.write_text("damaged")
    succeed("odometry", recording, "--out", out, "--replace")
    assert len(read_trajectory(out)) == 4
