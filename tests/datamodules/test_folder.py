"""Any folder of scans and labels can be trained on."""

from pathlib import Path

import pytest

from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.sources.source import Source


def names(frames: Source) -> list[str]:
    return [Path(frame.name).name for frame in frames]


def test_patterns_find_scans_of_all_formats_each_in_order(tmp_path, write) -> None:
    for name in ("b.bin", "a.pcd", "c.npz"):
        write(tmp_path / name, (tmp_path / name).with_suffix(".label"))
    (tmp_path / "folder").mkdir()  # is no scan
    data = Folder(str(tmp_path), "wads", train=["*"], validation=["b.*", "a.*"], test=["[ac].*"])
    assert names(data.frames("train")) == ["a.pcd", "b.bin", "c.npz"]
    assert names(data.frames("validation")) == ["b.bin", "a.pcd"]
    assert names(data.frames("test")) == names(data.frames("predict")) == ["a.pcd", "c.npz"]


def test_a_pattern_reaches_into_folders_and_may_be_absolute(tmp_path, write) -> None:
    root = tmp_path / "run [1]"  # the signs of patterns are none in a root
    deep = root / "day" / "one" / "a.bin"
    write(deep, deep.with_suffix(".label"))
    for pattern in ("**/*.bin", "day/*/*.bin", str(tmp_path / "run*" / "*" / "one" / "*.bin")):
        (frame,) = Folder(str(root), "wads", train=[pattern]).frames("train")
        assert (frame.path, frame.label_path) == (deep, deep.with_suffix(".label"))


def test_a_part_without_patterns_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"no patterns for validation\. Give --data\.validation"):
        Folder(str(tmp_path), "wads", train=["*.bin"]).frames("validation")


@pytest.mark.parametrize("pattern", ["*.pcd", "", "velodyne/*", "velodyne", "*.label"])
def test_a_pattern_that_finds_nothing_is_named(tmp_path, write, pattern) -> None:
    write(tmp_path / "a.bin", tmp_path / "a.label")
    (tmp_path / "velodyne").mkdir()
    with pytest.raises(InputError, match="matches no scan") as refusal:
        Folder(str(tmp_path), "wads", train=["a.bin", pattern]).frames("train")
    assert str(tmp_path / pattern) in str(refusal.value)
