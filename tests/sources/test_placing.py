"""Where the sensor was: told by a user, before any record."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.placing import along, standing
from derain.sources.source import Frames

LINE = "1 0 0 {x} 0 1 0 0 0 0 1 0\n"


@pytest.fixture
def drive(tmp_path: Path) -> Path:
    """Three scans beside a record of poses."""
    folder = tmp_path / "drive/velodyne"
    folder.mkdir(parents=True)
    for number in range(3):
        scene(10, number).tofile(folder / f"{number}.bin")
    write(folder.parent / "poses.txt", 7, 8, 9)
    return folder


def write(path: Path, *metres: float) -> Path:
    path.write_text("".join(LINE.format(x=x) for x in metres))
    return path


def x_of(source: Frames) -> list[float]:
    return [float(frame.pose[0, 3]) for frame in source if frame.pose is not None]


def test_a_file_of_poses_goes_before_the_one_beside_the_scans(drive: Path, tmp_path: Path) -> None:
    source = named_frames([drive])
    assert x_of(source) == [7, 8, 9]
    assert x_of(along(source, write(tmp_path / "mine.txt", 1, 2, 3))) == [1, 2, 3]
    assert x_of(along(source[1:], write(tmp_path / "mine.txt", 1, 2, 3))) == [2, 3]


def test_a_standing_sensor_has_one_pose(drive: Path) -> None:
    for frame in (
        *standing(named_frames([drive])),
        *standing(Frames.of_scans([Scan.of(scene(9))])),
    ):
        np.testing.assert_array_equal(frame.pose, np.eye(4))


def test_poses_that_do_not_fit_are_refused(drive: Path, tmp_path: Path) -> None:
    source = named_frames([drive])
    with pytest.raises(InputError, match="has 2 lines for 3 scans, and none for 2"):
        along(source, write(tmp_path / "mine.txt", 1, 2))
    with pytest.raises(InputError, match="none"):
        along(source, tmp_path / "none.txt")
    other = tmp_path / "other"
    other.mkdir()
    scene(10).tofile(other / "9.bin")
    with pytest.raises(InputError, match="the scans lie in 2 folders"):
        along(named_frames([drive, other]), write(tmp_path / "mine.txt", 1, 2, 3))
    with pytest.raises(InputError, match="the scans lie in 0 folders"):
        along(Frames.of_scans([Scan.of(scene(9))]), tmp_path / "mine.txt")
