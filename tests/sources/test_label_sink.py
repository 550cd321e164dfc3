"""Labels go into a folder, and take the place of none that are there."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.sources.folders import frames_of, relative_keys
from derain.sources.sink import LabelSink
from derain.sources.source import Frames, Source


def source(root: Path, *names: str, labels: str = "labels") -> Source:
    paths = [root / name for name in names]
    return frames_of(
        paths,
        lambda path: path.parent.parent / labels / f"{path.stem}.label",
        ("x", "y", "z", "intensity"),
        relative_keys(paths),
    )


def test_labels_are_written_by_the_keys_of_their_frames(tmp_path: Path) -> None:
    sink, frames = LabelSink(tmp_path / "out"), source(tmp_path, "a/0.bin", "b/0.bin")
    sink.refuse_clashes(frames)
    for frame, label in zip(frames, ([0, 1], [1, 0, 1]), strict=True):
        sink.write(frame, None, np.array(label))
    written = {path.relative_to(sink.folder).as_posix() for path in sink.folder.rglob("*.*")}
    assert written == {"a/0.label", "b/0.label"}
    assert np.fromfile(tmp_path / "out/b/0.label", "<u4").tolist() == [1, 0, 1]


@pytest.mark.parametrize("own", ["a/0.label", "labels/0.label", "truth/0.label"])
def test_labels_that_are_there_stay(tmp_path: Path, own: str) -> None:
    frames = source(tmp_path, "a/0.bin", labels="truth")
    label = tmp_path / own
    label.parent.mkdir(parents=True)
    sink = LabelSink(label.parent, "--labels")
    sink.refuse_clashes(frames)  # where they would be looked for, and are not
    label.write_bytes(b"")
    with pytest.raises(InputError, match=r"overwrite the labels .*0\.label\. Give --labels"):
        sink.refuse_clashes(frames)


def test_what_is_found_for_one_scan_is_not_written_over_the_labels_of_another(
    tmp_path: Path,
) -> None:
    frames = source(tmp_path, "0.bin", "out/0.bin")
    (tmp_path / "out").mkdir()
    (tmp_path / "out/0.label").touch()
    with pytest.raises(InputError, match="overwrite the labels"):
        LabelSink(tmp_path / "out").refuse_clashes(frames)


def test_two_scans_of_one_key_are_refused_and_one_that_comes_twice_is_not(tmp_path: Path) -> None:
    sink = LabelSink(tmp_path / "out")
    sink.refuse_clashes(source(tmp_path, "a/0.bin", "a/0.bin"))
    with pytest.raises(InputError, match="would both be"):
        sink.refuse_clashes(source(tmp_path, "a/0.bin", "a/0.pcd"))
    sink.refuse_clashes(Frames([]))
