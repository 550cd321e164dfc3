"""The manifest of taught labels: what is written is read, and nothing damaged is."""

import os
from pathlib import Path
from typing import Any

import pytest
import yaml

from derain.annotation.manifest import (
    LABELS,
    TAUGHT_MANIFEST,
    Manifest,
    TaughtScan,
    is_taught,
)
from derain.errors import InputError

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


def put(root: Path, content: object) -> Path:
    root.mkdir(exist_ok=True)
    (root / TAUGHT_MANIFEST).write_text(yaml.safe_dump(content, sort_keys=False))
    return root


def test_what_is_written_is_read(tmp_path: Path) -> None:
    scans = [
        TaughtScan("drive/00", tmp_path / "drive/00.bin", "drive", 0, "train"),
        TaughtScan("drive/01", tmp_path / "drive/ä 01.bin.gz", "010", 12, "validation"),
    ]
    twice = [1.5, True]
    teacher = {"method": "dror", "a": twice, "b": {"c": twice}}
    manifest = Manifest(teacher, scans, ("x", "y", "z"), 255.0)
    root = tmp_path / "taught"
    root.mkdir()
    manifest.write(root)
    assert is_taught(root)
    assert Manifest.read(root) == Manifest(
        manifest.teacher, tuple(scans), manifest.columns, manifest.intensity_scale
    )
    (frame,) = manifest.frames(root, "validation")
    assert (frame.key, frame.sequence, frame.number) == ("drive/01", "010", 12)
    assert frame.label_path == root / LABELS / "drive/01.label"
    assert frame.intensity_scale == 255.0


def test_labels_and_scans_move_together(tmp_path: Path) -> None:
    root = tmp_path / "here/taught"
    root.mkdir(parents=True)
    scan = TaughtScan("0", tmp_path / "here/drive/0.bin", "drive", 0, "train")
    Manifest({"method": "dror"}, [scan]).write(root)
    (tmp_path / "here").rename(tmp_path / "there")
    (moved,) = Manifest.read(tmp_path / "there/taught").scans
    assert moved.scan == tmp_path / "there/drive/0.bin"


def test_scans_are_found_through_a_link_to_the_folder(tmp_path: Path) -> None:
    deep = tmp_path / "a/b/taught"
    deep.mkdir(parents=True)
    os.symlink(deep, tmp_path / "link")
    scan = TaughtScan("0", tmp_path / "drive/0.bin", "drive", 0, "train")
    Manifest({"method": "dror"}, [scan]).write(tmp_path / "link")
    for root in (deep, tmp_path / "link"):
        assert Manifest.read(root).scans == (scan,)


def changed(**values: Any) -> dict[str, Any]:
    return {**CONTENT, **values}


def of_scan(**values: Any) -> dict[str, Any]:
    return changed(scans=[{**ENTRY, **values}])


@pytest.mark.parametrize(
    ("content", "reason"),
    [
        ([], "`derain teach` did not write it"),
        (changed(made_by="me"), "`derain teach` did not write it"),
        (changed(finished=False), "its labels are not complete"),
        (changed(finished="yes"), "neither true nor false"),
        (changed(scans=[ENTRY, {**ENTRY, "number": 1}]), "two scans have one key"),
        (changed(scans={}), "is not a list"),
        (changed(intensity_scale=0), "is not within"),
        (changed(columns="xyz"), "is not a list"),
        (changed(teacher="crf"), "is not a mapping"),
        (changed(more=1), "there is no such key"),
        (of_scan(key="../a"), "is not the name of a scan"),
        (of_scan(key="/a"), "is not the name of a scan"),
        (of_scan(key="a//b"), "is not the name of a scan"),
        (of_scan(key=""), "is not the name of a scan"),
        (of_scan(key=7), "is no text"),
        (of_scan(scan=None), "is no text"),
        (of_scan(part="test"), "Give train or validation"),
        (of_scan(number=-1), "is not a whole number"),
        (of_scan(number=True), "is not a whole number"),
        (changed(scans=[{"key": "a"}]), "scan is missing"),
        ({"made_by": "derain.teaching"}, "teacher is missing"),
    ],
)
def test_what_is_damaged_is_one_error(tmp_path: Path, content: object, reason: str) -> None:
    root = put(tmp_path / "taught", content)
    with pytest.raises(InputError) as raised:
        Manifest.read(root)
    assert str(root / TAUGHT_MANIFEST) in str(raised.value)
    assert reason in str(raised.value)


def test_the_sound_one_is_read(tmp_path: Path) -> None:
    (scan,) = Manifest.read(put(tmp_path / "taught", CONTENT)).scans
    assert scan == TaughtScan("a/0", tmp_path / "b.bin", "d", 0, "train")


def test_what_is_no_folder_of_taught_labels_is_told(tmp_path: Path) -> None:
    with pytest.raises(InputError, match=r"has no taught\.yaml"):
        Manifest.read(tmp_path)
    (tmp_path / TAUGHT_MANIFEST).write_text("{")
    with pytest.raises(InputError, match=TAUGHT_MANIFEST):
        Manifest.read(tmp_path)
    assert not is_taught(tmp_path)
    assert not is_taught(tmp_path / "none")
