"""Any folder of scans and labels can be trained on."""

from collections.abc import Callable
from pathlib import Path

import pytest

from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.sources.source import Source

Write = Callable[..., None]


def names(frames: Source) -> list[str]:
    return [Path(frame.name).name for frame in frames]


def test_a_pattern_finds_scans_of_all_formats_in_order(tmp_path: Path, write: Write) -> None:
    for name in ("b.bin", "a.pcd", "c.npz"):
        write(tmp_path / name, (tmp_path / name).with_suffix(".label"))
    data = Folder(str(tmp_path), "wads", train=["*"], validation=["b.*"], test=["[ac].*"])
    assert names(data.frames("train")) == ["a.pcd", "b.bin", "c.npz"]
    assert names(data.frames("validation")) == ["b.bin"]
    assert names(data.frames("test")) == names(data.frames("predict")) == ["a.pcd", "c.npz"]


def test_patterns_are_taken_one_after_the_other(tmp_path: Path, write: Write) -> None:
    for name in ("a.bin", "b.bin"):
        write(tmp_path / name, (tmp_path / name).with_suffix(".label"))
    data = Folder(str(tmp_path), "wads", train=["b.bin", "a.bin"])
    assert names(data.frames("train")) == ["b.bin", "a.bin"]


def test_a_pattern_reaches_into_folders_and_may_be_absolute(tmp_path: Path, write: Write) -> None:
    root = tmp_path / "run [1]"  # the signs of patterns are none in a root
    deep = root / "day" / "one" / "a.bin"
    write(deep, deep.with_suffix(".label"))
    for pattern in ("**/*.bin", "day/*/*.bin", str(tmp_path / "run*" / "*" / "one" / "*.bin")):
        (frame,) = Folder(str(root), "wads", train=[pattern]).frames("train")
        assert (frame.path, frame.label_path) == (deep, deep.with_suffix(".label"))


def test_labels_lie_beside_a_scan_or_in_the_sibling_folder(tmp_path: Path, write: Write) -> None:
    write(tmp_path / "velodyne" / "a.bin", tmp_path / "labels" / "a.label")
    write(tmp_path / "velodyne" / "b.bin", tmp_path / "velodyne" / "b.label")
    write(tmp_path / "elsewhere" / "b.bin", tmp_path / "labels" / "b.label")
    frames = Folder(str(tmp_path), "wads", train=["velodyne/*.bin"]).frames("train")
    assert [frame.label_path for frame in frames] == [
        tmp_path / "labels" / "a.label",
        tmp_path / "velodyne" / "b.label",
    ]


def test_prediction_needs_no_labels(tmp_path: Path, write: Write) -> None:
    write(tmp_path / "a.bin")
    data = Folder(str(tmp_path), "wads", test=["*.bin"])
    (frame,) = data.frames("predict")
    assert (frame.path, frame.has_labels) == (tmp_path / "a.bin", False)
    with pytest.raises(InputError, match=r"a\.bin: its labels are not at .*labels/a\.label"):
        data.frames("test")


def test_a_part_without_patterns_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"no patterns for validation\. Give --data\.validation"):
        Folder(str(tmp_path), "wads", train=["*.bin"]).frames("validation")


@pytest.mark.parametrize("pattern", ["*.pcd", "", "velodyne/*", "*.label"])
def test_a_pattern_that_finds_nothing_is_named(tmp_path: Path, write: Write, pattern: str) -> None:
    write(tmp_path / "a.bin", tmp_path / "a.label")
    with pytest.raises(InputError, match="matches no scan") as refusal:
        Folder(str(tmp_path), "wads", train=["a.bin", pattern]).frames("train")
    assert str(tmp_path / pattern) in str(refusal.value)


def test_a_card_that_is_not_there_is_named(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="winter: no such data card"):
        Folder(str(tmp_path), "winter")
