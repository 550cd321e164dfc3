"""One scan in its sequence: in a file, or in memory."""

import pickle
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.cards.card import load_card
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.scan import Scan
from derain.sources.file_frame import FileFrame
from derain.sources.folders import frame_of
from derain.sources.frame import MemoryFrame
from derain.sources.reader import FrameReader
from derain.sources.source import Frames


@pytest.fixture
def labelled(tmp_path) -> FileFrame:
    """A scan of 50 points with labels beside it, those of ten of them 110."""
    scene(50).tofile(tmp_path / "scan.bin")
    write_labels(tmp_path / "scan.label", np.where(np.arange(50) < 10, 110, 0), np.arange(50))
    return frame_of(tmp_path / "scan.bin")


@pytest.mark.parametrize("name", ["scan.bin", "scan.pcd", "SCAN.BIN.GZ", "1.5.ply", "scan.npz"])
def test_key_and_suffix_make_the_name_of_the_file(name) -> None:
    frame = frame_of(Path("folder") / name)
    assert frame.key + frame.suffix == name
    assert frame.name == str(Path("folder") / name)


def test_a_file_is_read_when_it_is_asked_for(labelled) -> None:
    np.testing.assert_array_equal(labelled.read().xyz, scene(50)[:, :3])
    assert labelled.read().label is None
    label = labelled.read_label(50)
    assert (label.dtype, np.bincount(label)[110]) == (np.int64, 10)  # instances are left out
    frame_of(Path("nowhere.bin"))
    with pytest.raises(InputError, match=r"nowhere\.bin: there is no such file"):
        frame_of(Path("nowhere.bin")).read()


def test_labels_that_are_not_to_be_read_do_not_count(labelled) -> None:
    memory = MemoryFrame(key="0", scan=labelled.read().with_label(labelled.read_label(50)))
    for frame in (labelled, memory):
        bare = frame.without_labels()
        assert (frame.has_labels, bare.has_labels) == (True, False)
        assert bare.fingerprint() == frame.fingerprint()
    with pytest.raises(InputError, match="it has no labels"):
        labelled.without_labels().read_label(50)
    with pytest.raises(InputError, match=r"it has no labels\. .*labelled=True"):
        labelled.without_labels().require_labels()


def test_labels_that_the_card_does_not_know_are_named(labelled) -> None:
    scan = FrameReader(load_card("wads")).read(labelled)
    assert (scan.label == 110).sum() == 10
    with pytest.raises(InputError, match=r"scan\.label: ids \[110\] are no classes of REHEARSE-3D"):
        FrameReader(load_card("rehearse3d")).read(labelled)


def test_intensities_are_seen_in_another_unit_and_kept_as_they_are(labelled) -> None:
    memory = MemoryFrame(key="0", scan=labelled.read())
    for frame in (labelled, memory):
        scan = frame.with_intensity_times(2).with_intensity_times(3).read()
        np.testing.assert_array_equal(scan.intensity, scene(50)[:, 3] * np.float32(6))
        np.testing.assert_array_equal(scan.fields["intensity"], scene(50)[:, 3])
        assert frame.read().intensity[0] == scene(50)[0, 3]


def test_fingerprints_of_files_differ_by_their_ends(tmp_path) -> None:
    long = np.zeros(2**18, np.uint8)
    contents = {"same": long, "first": long.copy(), "last": long.copy(), "longer": np.zeros(2**19)}
    contents["first"][0] = contents["last"][-1] = 1
    prints = set()
    for name, content in contents.items():
        content.tofile(tmp_path / f"{name}.bin")
        prints.add(frame_of(tmp_path / f"{name}.bin").fingerprint())
    assert len(prints) == 4
    assert all(len(text) == 16 and int(text, 16) >= 0 for text in prints)
    long.tofile(tmp_path / "copy.bin")
    assert frame_of(tmp_path / "copy.bin").fingerprint() in prints


def test_a_given_pose_goes_before_the_record_beside_the_scan(labelled) -> None:
    (labelled.path.parent / "poses.txt").write_text("damaged")
    pose = np.eye(4)
    assert labelled.with_pose(pose).pose is pose
    with pytest.raises(InputError, match="line 1 is not 12 numbers"):
        labelled.pose  # noqa: B018


@pytest.mark.parametrize(
    "pose", [np.zeros((4, 4)), 2 * np.eye(4), np.full((4, 4), np.nan), np.eye(3), "home"]
)
def test_a_pose_that_is_no_rigid_motion_is_refused(labelled, pose) -> None:
    with pytest.raises(InputError, match="pose is not rigid"):
        labelled.with_pose(pose)


def test_a_scan_in_memory_is_a_frame_like_any(labelled) -> None:
    scan = Scan.of(scene(50), "mine").with_label(labelled.read_label(50))
    frame = MemoryFrame(key="0", scan=scan, time=1.5)
    assert (frame.name, frame.suffix, frame.time, frame.count_points()) == ("mine", "", 1.5, 50)
    assert frame.pose is None
    assert frame.read().label is None
    np.testing.assert_array_equal(frame.read_label(50), scan.label)
    brighter = replace(scan, intensity=scan.intensity + 1)
    other = MemoryFrame(key="0", scan=brighter)
    assert other.fingerprint() != frame.fingerprint()


def test_a_source_can_be_gone_through_again() -> None:
    scans = [Scan.of(scene(points)) for points in range(1, 6)]
    source = Frames(iter(Frames.of_scans(scans, "drive")))
    assert [frame.key for frame in source] == [f"drive/{number:06d}" for number in range(5)]
    assert [frame.number for frame in source] == [*range(5)]
    assert {frame.sequence for frame in source} == {"drive"}
    for each in (pickle.loads(pickle.dumps(source)), source, source):
        assert [len(frame.read()) for frame in each] == [1, 2, 3, 4, 5]
    assert [frame.number for frame in source[:0:-2]] == [4, 2]


def test_a_frame_follows_the_one_before_it_in_its_sequence() -> None:
    def frame(sequence: str, number: int) -> MemoryFrame:
        return MemoryFrame(key="", sequence=sequence, number=number, scan=Scan.of(scene(1)))

    assert frame("a", 1).follows(frame("a", 0))
    assert not frame("a", 2).follows(frame("a", 0))
    assert not frame("a", 0).follows(frame("a", 0))
    assert not frame("b", 1).follows(frame("a", 0))
