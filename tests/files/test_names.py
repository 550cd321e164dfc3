"""A scan's stem and format: what is made of scan.bin and of scan.bin.gz has one name."""

import gzip
from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan
from derain.evaluation.hard_cases import scene
from derain.files import read_scan, write_scan
from derain.files.labels import label_beside
from derain.files.names import beside, scan_stem, scan_suffix


@pytest.mark.parametrize(
    ("name", "stem", "suffix"),
    [
        ("scan.bin", "scan", ".bin"),
        ("scan.bin.gz", "scan", ".bin"),
        ("SCAN.PCD.GZ", "SCAN", ".pcd"),
        ("1634567.25.bin", "1634567.25", ".bin"),
        ("1634567.25.npz.gz", "1634567.25", ".npz"),
        ("scan", "scan", ""),
        ("scan.gz", "scan", ""),
    ],
)
def test_stem_and_suffix_leave_the_compression_out(name: str, stem: str, suffix: str) -> None:
    path = Path("folder") / name
    assert (scan_stem(path), scan_suffix(path)) == (stem, suffix)
    assert beside(path, ".label") == Path("folder") / f"{stem}.label"


def test_labels_of_a_compressed_scan_are_found(tmp_path: Path) -> None:
    for scan in (tmp_path / "000012.bin.gz", tmp_path / "000013.bin"):
        assert label_beside(scan).parent.name == "labels"
        (tmp_path / f"{scan.name[:6]}.label").touch()
        assert label_beside(scan) == tmp_path / f"{scan.name[:6]}.label"


@pytest.mark.parametrize("suffix", [".bin", ".npy", ".npz", ".pcd", ".ply", ".csv", ".txt"])
def test_every_format_is_compressed_into_the_same_bytes(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, suffix: str
) -> None:
    points = scene(50)
    scan = Scan(points[:, :3].copy(), points[:, 3].copy())
    write_scan(tmp_path / f"scan{suffix}", scan)
    write_scan(tmp_path / f"first{suffix}.gz", scan)
    monkeypatch.setattr("time.time", lambda: 1e9)  # what .gz files are usually stamped with
    write_scan(tmp_path / f"second{suffix}.gz", scan)
    first = (tmp_path / f"first{suffix}.gz").read_bytes()
    assert first == (tmp_path / f"second{suffix}.gz").read_bytes()
    assert gzip.decompress(first) == (tmp_path / f"scan{suffix}").read_bytes()
    np.testing.assert_array_equal(read_scan(tmp_path / f"first{suffix}.gz").xyz, scan.xyz)


def test_members_of_a_gzip_follow_one_another_and_damage_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "scan.bin.gz"
    points = scene(20)
    content = gzip.compress(points[:7].tobytes()) + gzip.compress(points[7:].tobytes())
    path.write_bytes(content)
    np.testing.assert_array_equal(read_scan(path).xyz, points[:, :3])
    for damaged in (content[:-1], content[:40], b"plain", content[:30] + b"?" + content[31:]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"scan\.bin\.gz: cannot be read as \.bin"):
            read_scan(path)
