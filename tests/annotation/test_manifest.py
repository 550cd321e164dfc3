"""The manifest of taught labels: what is written is read, and nothing damaged is."""

import os
from typing import Any

import pytest
import yaml

from derain.annotation.manifest import (
    LABELS,
    TAUGHT_MANIFEST,
    Manifest,
    TaughtScan,
    is_taught,
    parts_of,
)
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.source import Frames

ENTRY = {"key": "a/0", "scan": "../b.bin", "sequence": "d", "number": 0, "part": "train"}
CONTENT = {
    "made_by": "derain.teaching",
    "derain": "0.1.0",
    "teacher": {"method": "crf", "steps": [1, 2.5]},
    "columns": ["x", "y", "z"],
    "intensity_scale": 255.0,
    "finished": True,
    "scans": [ENTRY],
}


def test_what_is_written_is_read(tmp_path) -> None:
    scans = [
        TaughtScan("drive/00", tmp_path / "drive/00.bin", "drive", 0, "train"),
        TaughtScan("drive/01", tmp_path / "drive/ä 01.bin.gz", "010", 12, "validation"),
    ]
    twice = [1.5, True]
    teacher = {"method": "dror", "a": twice, "b": {"c": twice}}
    manifest = Manifest(teacher, scans, ("x", "y", "z"), 255.0)
    root = tmp_path / "taught"
    root.mkdir()
    assert not is_taught(root)
    manifest.write(root)
    assert is_taught(root)
    assert Manifest.read(root) == Manifest(
        manifest.teacher, tuple(scans), manifest.columns, manifest.intensity_scale
    )
    (frame,) = manifest.frames(root, "validation")
    assert (frame.key, frame.sequence, frame.number) == ("drive/01", "010", 12)
    assert frame.label_path == root / LABELS / "drive/01.label"
    assert frame.intensity_scale == 255.0


def test_labels_and_scans_move_together_and_are_found_through_a_link(tmp_path) -> None:
    root = tmp_path / "here/a/taught"
    root.mkdir(parents=True)
    os.symlink(root, tmp_path / "link")
    scan = TaughtScan("0", tmp_path / "here/drive/0.bin", "drive", 0, "train")
    Manifest({"method": "dror"}, [scan]).write(tmp_path / "link")
    for folder in (root, tmp_path / "link"):
        assert Manifest.read(folder).scans == (scan,)
    (tmp_path / "here").rename(tmp_path / "there")
    (moved,) = Manifest.read(tmp_path / "there/a/taught").scans
    assert moved.scan == tmp_path / "there/drive/0.bin"


def changed(**values: Any) -> dict[str, Any]:
    return {**CONTENT, **values}


def of_scan(**values: Any) -> dict[str, Any]:
    return changed(scans=[{**ENTRY, **values}])


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ([], "`derain teach` did not write it"),
        (changed(finished=False), "its labels are not complete"),
        (changed(scans=[ENTRY, {**ENTRY, "number": 1}]), "two scans have one key"),
        (changed(intensity_scale=0), "is not within"),
        (changed(teacher="crf"), "is not a mapping"),
        (changed(more=1), "there is no such key"),
        (of_scan(key="../a"), "is not the name of a scan"),
        (of_scan(key="/a"), "is not the name of a scan"),
        (of_scan(part="test"), "'test' is not known"),
        (of_scan(number=-1), "is not a whole number"),
        ({"made_by": "derain.teaching"}, "teacher is missing"),
    ],
)
def test_what_is_damaged_is_one_error(tmp_path, content, reason) -> None:
    file = tmp_path / TAUGHT_MANIFEST
    file.write_text(yaml.safe_dump(CONTENT))
    (sound,) = Manifest.read(tmp_path).scans
    assert sound == TaughtScan("a/0", tmp_path.parent / "b.bin", "d", 0, "train")
    file.write_text(yaml.safe_dump(content))
    with pytest.raises(InputError) as raised:
        Manifest.read(tmp_path)
    assert str(file) in str(raised.value)
    assert reason in str(raised.value)


def test_a_folder_without_a_manifest_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=r"has no taught\.yaml"):
        Manifest.read(tmp_path)


def sequence(length: int, name: str = "drive") -> list[Frame]:
    return [*Frames.of_scans([Scan.of(scene(5))] * length, name)]


def test_every_sequence_ends_with_held_out_scans_whatever_it_is_called() -> None:
    lengths = {0: 0, 1: 0, 2: 0, 3: 1, 5: 1, 9: 1, 10: 2, 20: 4}  # a fifth, and one of three
    frames, expected = [], []
    for length, held_out in lengths.items():
        frames += sequence(length)
        expected += ["train"] * (length - held_out) + ["validation"] * held_out
    assert list(parts_of(frames)) == expected
    frames = [*sequence(4)[:2], *sequence(6)[4:]]  # scans that are missing end no sequence
    assert list(parts_of(frames)) == ["train"] * 3 + ["validation"]
    other = [*sequence(3), *sequence(4, "other")[1:]]  # another name does
    assert list(parts_of(other)) == ["train", "train", "validation"] * 2
