"""What is made of frames goes to a folder, and takes the place of nothing it was made of."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files import read_scan
from derain.files.labels import read_labels
from derain.scan import Scan
from derain.sources.clean_sink import CleanSink
from derain.sources.folders import frame_of, frames_of, named_frames, relative_keys
from derain.sources.frame import MemoryFrame
from derain.sources.judgement import Judgement
from derain.sources.sink import FolderSink
from derain.sources.source import Frames, Source


def write(*paths: Path) -> None:
    for path in paths:
        path.parent.mkdir(parents=True, exist_ok=True)
        scene(30).tofile(path)


def names(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


def test_a_scan_from_memory_is_written_as_a_pcd(tmp_path) -> None:
    (frame,) = Frames.of_scans([Scan.of(scene(30))])
    scan, sink = frame.read(), FolderSink(tmp_path)
    sink.write(frame, scan, np.zeros(30, bool))
    assert names(tmp_path) == ["000000.label", "000000.pcd"]
    np.testing.assert_array_equal(read_scan(tmp_path / "000000.pcd").xyz, scene(30)[:, :3])


def test_without_its_scan_there_are_no_labels(tmp_path) -> None:
    (tmp_path / "000000.pcd").mkdir()
    (frame,) = Frames.of_scans([Scan.of(scene(30))])
    with pytest.raises(InputError, match="is not a file that can be replaced"):
        FolderSink(tmp_path).write(frame, frame.read(), np.zeros(30, bool))
    assert names(tmp_path) == []


@pytest.mark.parametrize(
    ("out", "reason"),
    [
        ("1/velodyne", "would overwrite"),
        ("1/labels", "holds the labels of"),
        ("1/lidar_radar_labels", "holds the labels of"),  # where the scans might be taken for those
        ("1/other/../labels", "holds the labels of"),
    ],
)
def test_neither_scans_nor_labels_are_overwritten(tmp_path, out, reason) -> None:
    write(tmp_path / "1/velodyne/0.bin")
    (tmp_path / "1/other").mkdir()
    for source in (named_frames([tmp_path / "1"]), named_frames([tmp_path / "1"], labelled=True)):
        with pytest.raises(InputError, match=reason) as error:
            FolderSink(tmp_path / out, option="--into").refuse_clashes(source)
        assert str(tmp_path / "1/velodyne/0.bin") in str(error.value)
        assert error.value.remedy == "Give --into another folder."
    FolderSink(tmp_path / "1/cleaned").refuse_clashes(source)


def labelled(root: Path, *names: str, labels: str = "labels") -> Source:
    paths = [root / name for name in names]
    return frames_of(
        paths,
        lambda path: path.parent.parent / labels / f"{path.stem}.label",
        ("x", "y", "z", "intensity"),
        relative_keys(paths),
    )


def test_labels_that_a_frame_names_are_not_overwritten(tmp_path) -> None:
    source = labelled(tmp_path, "lidar/0.bin", labels="truth")
    with pytest.raises(InputError, match="holds the labels of"):
        FolderSink(tmp_path / "truth").refuse_clashes(source)


def test_a_link_to_the_scans_is_their_folder(tmp_path) -> None:
    write(tmp_path / "scans/0.bin")
    (tmp_path / "link").symlink_to(tmp_path / "scans", target_is_directory=True)
    with pytest.raises(InputError, match="would overwrite"):
        FolderSink(tmp_path / "link").refuse_clashes(named_frames([tmp_path / "scans"]))


def test_two_scans_of_one_key_are_refused(tmp_path) -> None:
    write(tmp_path / "a/0.bin", tmp_path / "b/0.npy")
    source = named_frames([tmp_path / "a", tmp_path / "b/0.npy"])
    with pytest.raises(InputError, match="another scan has the same name") as error:
        FolderSink(tmp_path / "out").refuse_clashes(source)
    assert all(name in str(error.value) for name in ("a/0.bin", "b/0.npy", "out/0.label"))
    for names_in_memory in (("x", "y"), ("array", "array")):
        scans = [MemoryFrame(key="0", scan=Scan.of(scene(3), name)) for name in names_in_memory]
        with pytest.raises(InputError, match="another scan has the same name"):
            FolderSink(tmp_path / "out").refuse_clashes(scans)


def test_one_scan_twice_is_refused(tmp_path) -> None:
    write(tmp_path / "0.bin")
    twice = [frame_of(tmp_path / "0.bin"), frame_of(tmp_path / "0.bin")]
    with pytest.raises(InputError, match=r"0\.bin: is named twice\. Name each scan once"):
        FolderSink(tmp_path / "out").refuse_clashes(twice)


def test_labels_named_among_the_scans_are_refused(tmp_path) -> None:
    write(tmp_path / "0.bin", tmp_path / "0.label")
    source = named_frames([tmp_path / "0.bin", tmp_path / "0.label"])
    with pytest.raises(InputError, match=r"0\.label: is a file of labels, not a scan"):
        FolderSink(tmp_path / "out").refuse_clashes(source)


def test_scans_labels_and_what_is_taken_away_are_named_by_the_key(tmp_path) -> None:
    write(*(tmp_path / f"data/sequences/{sequence}/velodyne/0.bin" for sequence in "ab"))
    source = named_frames([tmp_path / "data"])
    rain = np.arange(30) < 4
    with CleanSink(tmp_path / "out", source, removed=tmp_path / "removed") as sink:
        for frame in source:
            sink.write(Judgement(rain.astype(np.float32), rain, rain, frame.read(), frame))
    files = [f"{sequence}/velodyne/0{suffix}" for sequence in "ab" for suffix in (".bin", ".label")]
    assert names(tmp_path / "out") == files
    assert names(tmp_path / "removed") == files[::2]
    np.testing.assert_array_equal(read_labels(tmp_path / "out" / files[1], 30), rain)
    for folder, rows in (("out", ~rain), ("removed", rain)):
        assert (tmp_path / folder / files[2]).read_bytes() == scene(30)[rows].tobytes()


def test_what_is_taken_away_is_refused_where_it_would_take_a_place(tmp_path) -> None:
    write(tmp_path / "scans/1.bin")
    source = named_frames([tmp_path / "scans"])
    out = tmp_path / "out"
    with pytest.raises(InputError, match=r"would overwrite .*1\.bin.* --removed another folder"):
        CleanSink(out, source, removed=tmp_path / "scans")
    with pytest.raises(InputError, match="where the cleaned scans go"):
        CleanSink(out, source, removed=tmp_path / "scans/../out")
