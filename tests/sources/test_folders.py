"""Scans as a user names them: keys, order, sequences, and where their labels lie."""

import string
from collections import Counter
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.cards.layout import Layout
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.scan import Scan
from derain.sources.folders import named_frames, relative_keys, source_of
from derain.sources.frame import MemoryFrame
from derain.sources.search import find_layout, scan_folders

REHEARSE3D = Layout(scans="lidar_radar_pcd", labels="lidar_radar_labels", lidar="innoviz")
DRIVES = Layout(sequences="drives", scans="lidar", labels="truth")


def touch(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        path.touch()


@pytest.fixture
def wads(tmp_path) -> Path:
    """A data set of two sequences of two scans each, and one that is not finished."""
    root = tmp_path / "WADS"
    for name in ("11", "02", ".03"):
        for number in (1, 0):
            touch(root / f"sequences/{name}/velodyne/{number:06d}.bin")
    touch(root / "README.txt", root / "sequences/02/times.txt")
    return root


def test_scans_and_folders_come_in_the_order_they_are_named(tmp_path) -> None:
    touch(tmp_path / "b/2.bin", tmp_path / "b/1.pcd", tmp_path / "b/.0.bin", tmp_path / "a.bin")
    frames = named_frames([tmp_path / "b", tmp_path / "a.bin"])
    assert [frame.key for frame in frames] == ["1", "2", "a"]
    assert [frame.suffix for frame in frames] == [".pcd", ".bin", ".bin"]
    assert [frame.number for frame in frames] == [0, 1, 0]
    assert [frame.sequence for frame in frames] == [*2 * [tmp_path.name], tmp_path.parent.name]
    assert not any(frame.has_labels or frame.label_path for frame in frames)


def test_a_data_set_is_its_sequences(wads) -> None:
    keys = [f"{sequence}/velodyne/{number:06d}" for sequence in ("02", "11") for number in (0, 1)]
    for named in (wads, wads / "sequences"):
        frames = named_frames([named])
        assert [frame.key for frame in frames] == keys
        assert [frame.sequence for frame in frames] == ["02", "02", "11", "11"]
        assert [frame.number for frame in frames] == [0, 1, 0, 1]


def test_a_url_is_no_path_of_this_machine() -> None:
    with pytest.raises(InputError, match=r"^s3://bucket/drive: is not on this machine"):
        named_frames("s3://bucket/drive")


def test_one_sequence_has_plain_names(wads, monkeypatch) -> None:
    for named in (wads / "sequences/02", wads / "sequences/02/velodyne"):
        frames = named_frames([named])
        assert [frame.key for frame in frames] == ["000000", "000001"]
        assert {frame.sequence for frame in frames} == {"02"}
    monkeypatch.chdir(wads / "sequences/02/velodyne")
    assert [frame.key for frame in named_frames([Path()])] == ["000000", "000001"]
    assert {frame.sequence for frame in named_frames([Path()])} == {"02"}


def test_several_data_sets_and_scans_keep_apart(wads, tmp_path, monkeypatch) -> None:
    touch(tmp_path / "000000.bin")
    monkeypatch.chdir(tmp_path)
    frames = named_frames([wads, Path("000000.bin")])  # one path whole, one from here
    assert [frame.key for frame in frames][-2:] == ["WADS/sequences/11/velodyne/000001", "000000"]
    assert max(Counter(frame.key for frame in frames).values()) == 1


def test_scans_beside_folders_of_scans_are_what_is_meant(tmp_path) -> None:
    touch(tmp_path / "own.bin", tmp_path / "velodyne/0.bin", tmp_path / "texts/scan.csv")
    for named in (tmp_path, str(tmp_path), [str(tmp_path)]):
        assert [frame.key for frame in named_frames(named)] == ["own"]
    (text,) = named_frames(tmp_path / "texts")  # there is nothing else
    assert text.name == str(tmp_path / "texts/scan.csv")


@pytest.mark.parametrize("folder", ["", "sequences/00/velodyne", "sequences/01/velodyne"])
def test_what_is_passed_over_in_a_folder_is_counted_once(tmp_path, folder, capsys) -> None:
    place = tmp_path / folder
    touch(*(place / name for name in ("0.bin", "1.csv", "2.csv.gz", "3.txt", "4.mcap", "5.BAG")))
    # Labels, records of the scans, and what no format reads.
    touch(*(place / name for name in ("0.label", "poses.txt", "times.txt", "6.png", ".7.csv")))
    for _ in range(2):
        (frame,) = named_frames([tmp_path])
    assert Path(frame.name) == place / "0.bin"
    (warning,) = capsys.readouterr().err.splitlines()
    assert f"{place}: 1 .bag, 2 .csv, 1 .mcap, 1 .txt passed over" in warning


def test_no_warning_is_given_for_a_folder_whose_scans_are_all_taken(tmp_path, wads, capsys) -> None:
    touch(tmp_path / "texts/0.csv", tmp_path / "texts/times.txt", tmp_path / "texts/0.txt.label")
    named_frames([wads, tmp_path / "texts", tmp_path / "texts/0.csv"])
    assert capsys.readouterr().err == ""


@pytest.mark.parametrize("layout", [Layout(), REHEARSE3D, DRIVES])
def test_labels_lie_where_the_layout_puts_them(tmp_path, layout) -> None:
    sequence = tmp_path / layout.sequences / "7"
    touch(sequence / layout.scans / "3.bin.gz", sequence / layout.labels / "3.label")
    (frame,) = named_frames([tmp_path], labelled=True, layouts=[layout])
    assert frame.label_path == sequence / layout.labels / "3.label"
    assert frame.has_labels
    if layout is not DRIVES:  # which no packaged card has
        (named,) = named_frames([tmp_path], labelled=True)
        assert named.label_path == frame.label_path


@pytest.mark.parametrize("root", ["", "drives", "drives/1", "drives/1/lidar"])
def test_a_layout_is_known_from_the_root_to_the_scans(tmp_path, root) -> None:
    touch(tmp_path / "drives/1/lidar/0.bin", tmp_path / "drives/1/truth/0.label")
    assert find_layout(tmp_path / root) is None
    assert find_layout(tmp_path / root, [REHEARSE3D, DRIVES]) == DRIVES
    assert [frame.key for frame in named_frames([tmp_path / root], layouts=[DRIVES])] == ["0"]


def test_names_of_folders_are_no_patterns(tmp_path) -> None:
    odd = Layout(sequences="s*", scans="[lidar]", labels="?")
    touch(tmp_path / "s*/1/[lidar]/0.bin", tmp_path / "sx/2/l/0.bin")
    assert scan_folders(tmp_path, odd) == [tmp_path / "s*/1/[lidar]"]


@pytest.mark.parametrize(("name", "reason"), [("none", "no such file or"), ("empty", "no scans")])
def test_what_holds_nothing_is_refused(tmp_path, name, reason) -> None:
    (tmp_path / "empty/velodyne").mkdir(parents=True)
    with pytest.raises(InputError, match=reason):
        named_frames([tmp_path / name])


NAMES = st.text(string.ascii_lowercase + "0.é", min_size=1, max_size=4).filter(
    lambda name: name.strip(".") == name
)


@given(st.sets(st.lists(NAMES, min_size=1, max_size=4).map("/".join), min_size=1), st.booleans())
def test_keys_are_unlike_one_another_and_lead_to_the_scans(paths, whole) -> None:
    base = Path("/data" if whole else "data")
    scans = [base / f"{path}.bin" for path in paths]
    keys = relative_keys(scans)
    assert len(set(keys)) == len(scans)
    # From the folder that all lie below, every key with the suffix is the path again.
    ends = {str(scan).removesuffix(f"{key}.bin") for scan, key in zip(scans, keys, strict=True)}
    assert len(ends) == 1
    assert not any(Path(key).is_absolute() or ".." in Path(key).parts for key in keys)


def test_scans_frames_and_paths_stand_in_the_order_they_are_given(tmp_path) -> None:
    for number in range(2):
        scene(10 + number).tofile(tmp_path / f"{number}.bin")
        write_labels(tmp_path / f"{number}.label", np.arange(10 + number))
    scan = Scan.of(scene(30), "made")
    frame = MemoryFrame(key="framed", scan=Scan.of(scene(40)))
    source = source_of([scan, str(tmp_path), frame, tmp_path / "1.bin"])
    assert [len(each.read()) for each in source] == [30, 10, 11, 40, 11]
    assert [each.has_labels for each in source] == [False, True, True, False, True]
    assert [each.key for each in source] == ["000000", "0", "1", "framed", "1"]
    np.testing.assert_array_equal(source[1].read_label(10), np.arange(10))
    assert source_of(source) is source


def test_files_that_a_program_lists_are_a_recording(tmp_path) -> None:
    paths = [tmp_path / f"{number}.bin" for number in range(3)]
    touch(*paths)
    source = source_of([*paths[:2], str(paths[2])])
    assert [frame.number for frame in source] == [0, 1, 2]
    assert all(after.follows(before) for before, after in pairwise(source))


def test_wide_files_are_read_by_the_columns_that_are_named(tmp_path) -> None:
    np.zeros((7, 5), "<f4").tofile(tmp_path / "wide.bin")
    (frame,) = source_of(tmp_path / "wide.bin", ["x", "y", "z", "intensity", "ring"])
    assert len(frame.read()) == frame.count_points() == 7


def test_what_is_no_scan_is_refused() -> None:
    with pytest.raises(InputError, match="scans: there are none"):
        source_of([])
    with pytest.raises(InputError, match="scans: dict is no scan"):
        source_of([{}])


@pytest.fixture
def fleet(tmp_path) -> Path:
    """A folder of recordings of all makes, beside what is none of them."""
    root = tmp_path / "fleet"
    touch(
        *(root / "2024/a" / name for name in ("0.pcd", "1.pcd", "times.txt")),
        *(root / "2024/b/velodyne" / name for name in ("0.bin", "1.bin")),
        *(root / "2025/set/sequences" / name / "velodyne/7.bin" for name in ("00", "01")),
        *(root / name / "0.bin" for name in (".hidden", "results")),
        root / "results/.derain/job.json",
        root / "notes/list.txt",
    )
    (root / "2024/up").symlink_to(root)
    return root


def test_a_folder_of_recordings_is_all_of_them(fleet) -> None:
    frames = named_frames(fleet)
    found = ("2024/a", "2024/b", "2025/set/sequences/00", "2025/set/sequences/01")
    keys = [f"{folder}/{scan}" for folder in found[:2] for scan in (0, 1)]
    keys += [f"{folder}/7" for folder in found[2:]]
    assert [frame.key for frame in frames] == keys
    assert [frame.sequence for frame in frames] == [str(Path(key).parent) for key in keys]
    assert [frame.number for frame in frames] == [0, 1, 0, 1, 0, 0]
    one_by_one = named_frames([fleet / folder for folder in found])
    assert [frame.name for frame in frames] == [frame.name for frame in one_by_one]


def test_what_is_found_keeps_its_key_when_a_recording_is_added(fleet) -> None:
    before = {frame.name: frame.key for frame in named_frames(fleet)}
    touch(fleet / "2023/c/0.bin", fleet / "2025/set/sequences/02/velodyne/7.bin", fleet / "d/0.npy")
    after = {frame.name: frame.key for frame in named_frames(fleet)}
    assert len(after) == len(before) + 3
    assert after.items() > before.items()


def test_one_sequence_is_no_folder_of_recordings_to_what_takes_no_data_sets(fleet) -> None:
    with pytest.raises(InputError, match="no scans"):
        named_frames(fleet, layouts=())


def test_results_among_the_recordings_are_passed_over(fleet) -> None:
    before = [frame.key for frame in named_frames(fleet)]
    touch(fleet / "cleaned/2024/a/0.pcd", fleet / "link/0.pcd")  # of a run that kept no records
    (fleet / "to_results").symlink_to(fleet / "cleaned")
    results = [fleet / "cleaned", fleet / "link"]
    assert [frame.key for frame in named_frames(fleet, results=results)] == before
    assert len(named_frames(fleet)) == len(before) + 2


def test_simulated_data_is_found_though_it_has_records(fleet) -> None:
    touch(fleet / "results/manifest.json")
    assert "results/0" in [frame.key for frame in named_frames(fleet)]


def test_what_a_link_leads_to_is_found_once(tmp_path) -> None:
    fleet = tmp_path / "fleet"
    touch(fleet / "b/0.bin", tmp_path / "elsewhere/0.bin", fleet / "c/d/0.bin")
    (fleet / "a_latest").symlink_to(fleet / "b")
    (fleet / "a_other").symlink_to(tmp_path / "elsewhere")
    (fleet / "c/above").symlink_to(tmp_path)
    (fleet / "c/d/loop").symlink_to(fleet / "c")
    assert [frame.key for frame in named_frames(fleet)] == ["a_other/0", "b/0", "c/d/0"]


def test_scans_beside_folders_of_scans_hide_none_below_a_folder_of_recordings(tmp_path) -> None:
    touch(tmp_path / "fleet/day/map.npy", tmp_path / "fleet/day/a/0.bin")
    assert [frame.key for frame in named_frames(tmp_path / "fleet")] == ["day/map", "day/a/0"]


def test_what_was_named_by_itself_is_no_folder_of_recordings(tmp_path, monkeypatch, capsys) -> None:
    touch(tmp_path / "set/velodyne/0.bin", tmp_path / "set/velodyne/1.bin")
    touch(tmp_path / "sets/a/velodyne/0.bin", tmp_path / "sets/other/0.bin")
    touch(tmp_path / "sets/.hidden/0.bin", tmp_path / "sets/broken/drive.bag.active")
    monkeypatch.chdir(tmp_path / "set")
    assert [frame.key for frame in named_frames(".")] == ["0", "1"]
    assert capsys.readouterr().err == ""
    assert [frame.key for frame in named_frames(tmp_path / "sets")] == ["0"]
    warned = capsys.readouterr().err
    assert f"{tmp_path / 'sets'}: 1 other recording" in warned
    assert "drive.bag.active" in warned
