"""A store is listed as a folder of this machine is: the same scans, keys, times and poses."""

from pathlib import Path

import fsspec
import numpy as np
import pytest
from small_bags import small_bag, storage_file

import derain
from derain.errors import InputError
from derain.sources.store_listing import frames_at
from derain.sources.stored_frame import StoredBag


@pytest.fixture
def drives(tmp_path) -> Path:
    """Two recordings, the first with times and poses, the second with damaged poses."""
    root = tmp_path / "drives"
    for name in ("10", "9"):
        folder = root / "sequences" / name / "velodyne"
        folder.mkdir(parents=True)
        for number in (2, 10, 11):
            np.full((number, 4), number, "<f4").tofile(folder / f"{number}.bin")
        (folder / "note.txt").write_text("no scan")
    first = root / "sequences" / "10"
    (first / "times.txt").write_text("0.1\n0.2\n0.3\n")
    (first / "poses.txt").write_text("\n".join(f"1 0 0 {x} 0 1 0 0 0 0 1 0" for x in range(3)))
    (root / "sequences" / "9" / "poses.txt").write_text("no numbers\n")
    return root


def stored(folder: Path) -> str:
    """URL of a copy of a folder in a store in memory."""
    memory = fsspec.filesystem("memory")
    memory.store.clear()
    memory.put(f"{folder}/", "/bucket/drives/", recursive=True)
    return "memory://bucket/drives"


def test_scans_have_the_keys_times_and_poses_that_they_have_in_a_folder(drives) -> None:
    near, far = derain.named_frames(drives), frames_at([stored(drives)])
    assert len(far) == 6
    for here, there in zip(near, far, strict=True):
        for name in ("key", "sequence", "number", "suffix", "time"):
            assert getattr(here, name) == getattr(there, name)
        assert there.name == here.name.replace(str(drives), "memory://bucket/drives")
        assert here.size() == there.size()
        np.testing.assert_array_equal(here.read().xyz, there.read().xyz)
    for here, there in zip(near[:3], far[:3], strict=True):
        np.testing.assert_array_equal(here.pose, there.pose)


def test_damage_is_an_error_when_it_is_needed_and_names_its_url(drives) -> None:
    (drives / "sequences/9/velodyne/11.bin").write_bytes(b"broken")
    frame = frames_at([stored(drives)])[-2]
    assert frame.time is None
    for need, file in ((lambda: frame.pose, "poses.txt"), (frame.read, "velodyne/11.bin")):
        with pytest.raises(InputError) as caught:
            need()
        assert str(caught.value.subject) == f"memory://bucket/drives/sequences/9/{file}"


def test_a_changed_record_changes_the_stamps_of_its_scans_alone(drives) -> None:
    before = [frame.stamp() for frame in frames_at([stored(drives)])]
    memory = fsspec.filesystem("memory")
    memory.pipe("/bucket/drives/sequences/10/times.txt", b"1.1\n1.2\n1.3\n")
    after = [frame.stamp() for frame in frames_at(["memory://bucket/drives"])]
    assert all(one != other for one, other in zip(before[:3], after[:3], strict=True))
    assert before[3:] == after[3:]


def test_what_is_passed_over_is_warned_of_by_its_url(drives, capsys) -> None:
    velodyne = f"{stored(drives)}/sequences/10/velodyne"
    frames_at([velodyne])
    assert f"{velodyne}: 1 .txt" in capsys.readouterr().err


def test_a_bag_is_one_frame_with_all_of_its_files(tmp_path) -> None:
    small_bag(tmp_path / "bags", "mcap")
    (bag,) = frames_at([stored(tmp_path / "bags")], topic="/velodyne_points")
    assert isinstance(bag, StoredBag)
    assert (bag.key, bag.inner) == ("drive", "velodyne_points")
    assert sorted(each.path.name for each in bag.objects) == ["drive.mcap", "metadata.yaml"]


def test_a_log_beside_a_database_is_one_of_the_bags_files(tmp_path) -> None:
    storage_file(small_bag(tmp_path, "sqlite3")).replace(tmp_path / "drive/drive.db3")
    (tmp_path / "drive/metadata.yaml").unlink()
    (tmp_path / "drive/drive.db3-wal").write_bytes(b"messages")
    (bag,) = frames_at([stored(tmp_path / "drive")])
    assert [each.path.name for each in bag.objects] == ["drive.db3", "drive.db3-wal"]


def test_paths_and_urls_are_not_mixed(drives) -> None:
    with pytest.raises(InputError, match="two commands"):
        frames_at([stored(drives), drives])


def test_a_folder_of_recordings_is_the_same_in_a_store(drives) -> None:
    root = drives / "sequences"
    for name in ("10", "9"):  # to be no data set
        (root / name / "velodyne").rename(root / name / "points")
    (root / "results" / ".derain").mkdir(parents=True)
    (root / "results" / ".derain" / "job.json").write_text("{}")
    (root / "results" / "0.bin").write_bytes(bytes(16))
    near, far = derain.named_frames(root), frames_at([stored(root)])
    assert [frame.key for frame in far] == [frame.key for frame in near]
    assert [frame.sequence for frame in far] == [frame.sequence for frame in near]
    assert {frame.sequence for frame in far} == {"10/points", "9/points"}
