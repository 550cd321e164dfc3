"""Reading, writing and finding scans by suffix, and the real scans of many sensors."""

import gzip
import re
from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan, ScanWarning
from derain.evaluation.hard_cases import scene
from derain.files import DEFAULT_COLUMNS, find_scans, read_scan, write_scan
from derain.files.format import FORMATS
from derain.files.formats.ply import PlyHeader
from derain.files.names import beside, scan_stem, scan_suffix

RADAR = (
    *("x", "y", "z", "range_rate", "rcs", "range"),
    *("azimuth", "elevation", "probability", "class"),
)


@pytest.mark.parametrize(
    ("name", "points", "shape", "columns"),
    [
        ("clean/kitti_hdl64.bin", 124_668, None, 4),
        ("clean/pandaset_pandar64.pcd", 118_784, (64, 1856), 4),
        ("clean/ouster_os1_128.npz", 131_072, (128, 1024), 6),
        ("clean/ouster_os0_32_dual.npz", 32_768, (32, 1024), 11),
        ("clean/velodyne_vlp16_dual.pcd", 14_831, None, 10),
        ("radar/ars548_detections.npy", 308, None, 10),
    ],
)
def test_real_scans_come_back_bit_for_bit(tmp_path, shared, name, points, shape, columns) -> None:
    source = shared / "data" / name
    stated = RADAR if source.suffix == ".npy" else DEFAULT_COLUMNS
    scan = read_scan(source, stated)
    assert (len(scan), scan.shape, len(scan.fields)) == (points, shape, columns)
    assert np.median(scan.range[scan.valid]) > 1
    write_scan(tmp_path / source.name, scan)
    copy = read_scan(tmp_path / source.name, stated)
    assert copy.shape == shape
    assert list(copy.fields) == list(scan.fields)
    for title, column in scan.fields.items():
        assert copy.fields[title].dtype == column.dtype
        assert copy.fields[title].tobytes() == column.tobytes()


@pytest.mark.parametrize("name", ["intensity", "Intensity", "i", "remission", "rcs"])
def test_intensity_is_found_under_its_many_names(tmp_path, name) -> None:
    np.save(tmp_path / "scan.npy", np.arange(8.0).reshape(2, 4))
    scan = read_scan(tmp_path / "scan.npy", ("X", "Y", "Z", name))
    assert (scan.intensity is not None) == (name != "rcs")
    assert list(scan.fields) == ["X", "Y", "Z", name]


def test_names_in_upper_case_and_names_as_text_are_understood(tmp_path) -> None:
    path = str(tmp_path / "scan.Pcd")
    with pytest.raises(InputError, match="there is no such file"):
        read_scan(path)
    write_scan(path, np.ones((2, 4)))
    assert len(read_scan(path)) == 2
    assert len(find_scans([str(tmp_path)])) == 1


@pytest.mark.parametrize("use", [read_scan, lambda path: write_scan(path, Scan(np.zeros((1, 3))))])
def test_an_unknown_suffix_is_refused_with_the_known_ones(tmp_path, use) -> None:
    known = r"Available: \.asc, \.bin, \.csv, .*\.ply, \.txt, \.xyz, and each of them with \.gz\."
    for name in ("scan.e57", "scan.las", "scan", "scan.e57.gz", "scan.gz"):
        with pytest.raises(InputError, match=rf"{known} Convert.*frame of the sensor"):
            use(tmp_path / name)


def test_tables_are_scans_where_there_are_no_others(tmp_path) -> None:
    for name in ("1.txt", "metadata.csv", "times.txt"):
        (tmp_path / name).touch()
    assert [path.name for path in find_scans([tmp_path])] == ["1.txt"]
    (tmp_path / "0.csv").touch()  # what lies beside it may be a readme
    assert [path.name for path in find_scans([tmp_path])] == ["0.csv"]
    (tmp_path / "2.xyz").touch()
    assert [path.name for path in find_scans([tmp_path])] == ["2.xyz"]


def test_scans_of_every_format_are_found_compressed_or_not(tmp_path) -> None:
    names = {f"scan{suffix}{compressed}" for suffix in FORMATS for compressed in ("", ".gz")}
    for name in (*names, "scan.label.gz", "scan.gz", "scan.e57.gz"):
        (tmp_path / name).touch()
    records = {"scan.csv", "scan.txt", "scan.csv.gz", "scan.txt.gz"}
    assert {path.name for path in find_scans([tmp_path])} == names - records


def test_folders_stand_for_their_scans_in_order_and_files_for_themselves(tmp_path) -> None:
    folder = tmp_path / "velodyne"
    (folder / "deeper.bin").mkdir(parents=True)
    for name in ("2.bin", "10.pcd", "1.ply", "1.label", "notes.txt", "._1.ply", "3.npz", "0.npy"):
        (folder / name).touch()
    single = tmp_path / "any.thing"
    single.touch()
    found = find_scans([single, folder, folder / "2.bin"])
    names = ["0.npy", "1.ply", "10.pcd", "2.bin", "3.npz"]
    assert found == [single, *(folder / name for name in names), folder / "2.bin"]


def test_a_missing_path_and_a_folder_without_scans_are_refused(tmp_path) -> None:
    for name in ("notes.md", "times.txt", "poses.txt", "calib.txt", "timestamps.txt"):
        (tmp_path / name).touch()
    with pytest.raises(InputError, match=r"holds no scans \(\.asc, \.bin"):
        find_scans([tmp_path])
    with pytest.raises(InputError, match="there is no such file or folder"):
        find_scans([tmp_path / "missing"])


def test_what_a_written_file_lacks_is_warned_of(tmp_path) -> None:
    header = PlyHeader("ascii", left_out=("camera", "edge"))
    with pytest.warns(ScanWarning, match="camera, edge"):
        write_scan(tmp_path / "a.ply", Scan(np.ones((2, 3)), header=header))


@pytest.mark.parametrize(
    ("name", "stem", "suffix"),
    [
        ("scan.bin.gz", "scan", ".bin"),
        ("SCAN.PCD.GZ", "SCAN", ".pcd"),
        ("1634567.25.npz.gz", "1634567.25", ".npz"),
        ("scan.gz", "scan", ""),
    ],
)
def test_stem_and_suffix_leave_the_compression_out(name, stem, suffix) -> None:
    path = Path("folder") / name
    assert (scan_stem(path), scan_suffix(path)) == (stem, suffix)
    assert beside(path, ".label") == Path("folder") / f"{stem}.label"


def test_a_scan_is_compressed_into_the_same_bytes(tmp_path, monkeypatch) -> None:
    plain, first, second = (tmp_path / name for name in ("plain.csv", "1.csv.gz", "2.csv.gz"))
    write_scan(plain, scene(50))
    write_scan(first, scene(50))
    monkeypatch.setattr("time.time", lambda: 1e9)  # what .gz files are usually stamped with
    write_scan(second, scene(50))
    assert first.read_bytes() == second.read_bytes()
    assert gzip.decompress(first.read_bytes()) == plain.read_bytes()
    np.testing.assert_array_equal(read_scan(first).xyz, scene(50)[:, :3])
    np.testing.assert_array_equal(read_scan(first).intensity, scene(50)[:, 3])


def test_members_of_a_gzip_follow_one_another_and_damage_is_refused(tmp_path) -> None:
    path = tmp_path / "scan.bin.gz"
    points = scene(20)
    content = gzip.compress(points[:7].tobytes()) + gzip.compress(points[7:].tobytes())
    path.write_bytes(content)
    np.testing.assert_array_equal(read_scan(path).xyz, points[:, :3])
    for damaged in (content[:-1], content[:40], b"plain", content[:30] + b"?" + content[31:]):
        path.write_bytes(damaged)
        with pytest.raises(InputError, match=r"scan\.bin\.gz: cannot be read as \.bin"):
            read_scan(path)


def test_formats_are_listed_with_what_they_need(run_derain) -> None:
    printed = run_derain("info", "--formats").out
    assert all(suffix in printed and FORMATS[suffix].HELP in printed for suffix in FORMATS)
    assert re.search(
        r"^  \.feather +Arrow tables, version 2 \(needs derain\[feather\]\)$", printed, re.M
    )
