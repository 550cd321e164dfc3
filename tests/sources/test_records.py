"""When and where scans were taken, from the files beside them."""

import pickle
from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.sources.records import Records


def line(matrix: np.ndarray) -> str:
    return " ".join(repr(float(number)) for number in matrix[:3].ravel())


@pytest.fixture
def sequence(tmp_path) -> Path:
    """A sequence of three scans, which nobody reads."""
    folder = tmp_path / "sequences/00/velodyne"
    folder.mkdir(parents=True)
    for number in range(3):
        (folder / f"{number:06d}.bin").touch()
    return folder.parent


def scan(sequence: Path, number: int = 0) -> Path:
    return sequence / f"velodyne/{number:06d}.bin"


def records(sequence: Path) -> Records:
    return Records(sequence / "velodyne")


def test_nothing_is_known_without_a_record(sequence) -> None:
    assert records(sequence).time_of(scan(sequence)) is None
    assert records(sequence).pose_of(scan(sequence)) is None


@pytest.mark.parametrize(
    ("name", "text"),
    [
        ("times.txt", "0.0\n1.036e-01\n\n2.0e-1\n"),
        ("velodyne/times.txt", "0\n.1036\n.2"),
        ("velodyne/metadata.csv", "frame,timestamp\n000002,0.2\n0,0\n000001.bin,0.1036\n"),
    ],
)
def test_times_lie_above_the_scans_or_beside_them(sequence, name, text) -> None:
    (sequence / name).write_text(text)
    found = records(sequence)
    assert [found.time_of(scan(sequence, number)) for number in range(3)] == [0, 0.1036, 0.2]


def test_poses_by_time_go_to_the_scans_by_their_times(sequence) -> None:
    (sequence / "times.txt").write_text("10.0\n10.1\n10.2\n")
    (sequence / "poses.txt").write_text("9.9 0 0 0 0 0 0 1\n10.3 4 0 0 0 0 0 1\n")
    found = records(sequence)
    ahead = [found.pose_of(scan(sequence, number))[0, 3] for number in range(3)]
    np.testing.assert_allclose(ahead, (1, 2, 3))


@pytest.mark.parametrize("times", [None, "1700000000\n1700000001\n1700000002\n"])
def test_poses_by_a_time_that_the_scans_do_not_know_go_line_by_line(sequence, times) -> None:
    if times is not None:
        (sequence / "times.txt").write_text(times)
    lines = [f"{number} {number} 0 0 0 0 0 1" for number in range(3)]
    (sequence / "poses.txt").write_text("\n".join(lines))
    found = records(sequence)
    assert [found.pose_of(scan(sequence, number))[0, 3] for number in range(3)] == [0, 1, 2]


def test_of_a_partial_copy_each_scan_keeps_its_line(sequence) -> None:
    (sequence / "times.txt").write_text("".join(f"{number / 10}\n" for number in range(50)))
    scan(sequence, 42).touch()
    scan(sequence, 0).unlink()
    found = records(sequence)
    assert found.time_of(scan(sequence, 42)) == 4.2
    assert found.time_of(scan(sequence, 1)) == 0.1


def test_scans_whose_names_are_no_numbers_go_by_their_order(sequence) -> None:
    (sequence / "velodyne/last.bin").touch()
    (sequence / "times.txt").write_text("1\n2\n3\n4\n")
    assert records(sequence).time_of(sequence / "velodyne/last.bin") == 4


@pytest.mark.parametrize(
    ("name", "content", "reason"),
    [
        ("times.txt", b"0\nsoon\n2\n", "line 2 is not 1 number"),
        ("times.txt", b"0\n\n1 2\n2\n", "line 3 is not 1 number"),
        ("times.txt", b"0\n1e999\n2\n", "line 2 is not 1 number"),
        ("times.txt", b"\xff\xfe\n", "cannot be read"),
        ("times.txt", b"0\n1\n", "has 2 lines for 3 scans, and none for 000002.bin"),
        ("velodyne/metadata.csv", b"frame,timestamp\n0,1\n1,2\n", "no line for 000002.bin"),
        ("poses.txt", line(np.diag([1, 1, -1, 1])).encode(), "pose 1 is not rigid"),
        ("poses.txt", b"", "has 0 lines for 3 scans, and none for 000002.bin"),
        ("calib.txt", b"P0: 1 2 3\n", "has no line Tr"),
        ("calib.txt", b"P0: 1\nTr: 1 2 3\n", "line 2 is not 12 numbers"),
    ],
)
def test_damage_is_one_error_that_names_file_and_line(sequence, name, content, reason) -> None:
    if name == "calib.txt":
        (sequence / "poses.txt").write_text("\n".join(3 * [line(np.eye(4))]))
    (sequence / name).write_bytes(content)
    found = records(sequence)
    ask = found.time_of if name in ("times.txt", "velodyne/metadata.csv") else found.pose_of
    with pytest.raises(InputError) as error:
        ask(scan(sequence, 2))
    assert str(error.value).startswith(f"{sequence / name}: ")
    assert reason in str(error.value)
    assert error.value.remedy


def test_records_cross_to_other_processes(sequence) -> None:
    (sequence / "times.txt").write_text("1\n2\n3\n")
    found = records(sequence)
    assert pickle.loads(pickle.dumps(found)).time_of(scan(sequence, 1)) == 2
    assert found.time_of(scan(sequence, 1)) == 2
    (sequence / "times.txt").unlink()
    assert pickle.loads(pickle.dumps(found)).time_of(scan(sequence, 1)) == 2  # as it was read


def test_one_damaged_record_does_not_touch_the_other(sequence) -> None:
    (sequence / "times.txt").write_text("1\n2\n3\n")
    (sequence / "poses.txt").write_text("damaged")
    assert records(sequence).time_of(scan(sequence)) == 1
    (sequence / "times.txt").write_text("damaged")
    (sequence / "poses.txt").write_text("\n".join(3 * [line(np.eye(4))]))
    np.testing.assert_array_equal(records(sequence).pose_of(scan(sequence)), np.eye(4))
