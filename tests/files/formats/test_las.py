"""LAS and LAZ files: exact coordinates, every field, and their headers."""

import sys
from pathlib import Path

import laspy
import numpy as np
import pytest
from numpy.typing import NDArray

from derain import InputError, Scan
from derain.files import read_scan, write_scan
from derain.files.columns import with_column
from derain.files.format import FORMATS
from derain.system.extras import MissingExtraError

UTM = (500_000.0, 4_100_000.0, 100.0)
SUFFIXES = (".las", ".laz")


def write(
    path: Path, whole: NDArray[np.int32], offsets: tuple[float, ...] = UTM, version: str = "1.4"
) -> laspy.LasData:
    """A file of points whose coordinates are stored as these whole numbers, in millimetres."""
    header = laspy.LasHeader(version=version, point_format=7 if version == "1.4" else 3)
    header.scales, header.offsets = [0.001] * 3, offsets
    header.add_extra_dim(laspy.ExtraBytesParams("ring", np.uint16))
    header.add_extra_dim(laspy.ExtraBytesParams("normal", "3f4"))
    header.vlrs.append(laspy.VLR("derain", 7, "of our own", b"kept"))
    las = laspy.LasData(header)
    las.X, las.Y, las.Z = whole.T
    generator = np.random.default_rng(0)
    las.intensity = generator.integers(0, 2**16, len(whole))
    las.return_number = generator.integers(1, 5, len(whole))
    las.gps_time = generator.random(len(whole))
    las.red = las.ring = generator.integers(0, 2**16, len(whole))
    las.normal = generator.random((len(whole), 3))
    if version == "1.4":
        las.evlrs = laspy.vlrs.vlrlist.VLRList([laspy.VLR("derain", 8, "behind", b"kept as well")])
    las.write(str(path), laz_backend=laspy.LazBackend.Lazrs)
    return las


STREET = np.int32([(1, -2, 3), (30_001, -40_002, 1_700), (-(2**31), 2**31 - 1, 0), (5, 6, 7)])


@pytest.mark.parametrize("version", ["1.2", "1.4"])
@pytest.mark.parametrize("suffix", SUFFIXES)
def test_coordinates_are_relative_to_the_offset_and_the_file_comes_back_whole_or_cleaned(
    tmp_path, suffix, version
) -> None:
    path = tmp_path / f"scan{suffix}"
    las = write(path, STREET, version=version)
    scan = read_scan(path)
    np.testing.assert_allclose(scan.xyz, STREET / 1000, rtol=1e-7)
    np.testing.assert_array_equal(scan.intensity, las.intensity.astype(np.float32))
    np.testing.assert_array_equal(scan.fields["ring"], las.ring, strict=True)
    np.testing.assert_array_equal(scan.fields["normal"], las.normal)
    write_scan(tmp_path / f"copy{suffix}", scan)
    assert (tmp_path / f"copy{suffix}").read_bytes() == path.read_bytes()
    stay = np.array([True, False, True, True])
    write_scan(path, scan.take(stay))
    cleaned = laspy.read(path)
    assert cleaned.points.array.tobytes() == las.points.array[stay].tobytes()
    assert cleaned.header.offsets.tolist() == list(UTM)
    assert [record.record_data for record in cleaned.vlrs.get_by_id("derain", (7,))] == [b"kept"]
    behind = [] if version == "1.2" else [b"kept as well"]
    assert [record.record_data for record in cleaned.evlrs or []] == behind


def test_a_survey_without_an_offset_keeps_its_millimetres(tmp_path) -> None:
    path = tmp_path / "scan.las"
    whole = STREET[[0, 1, 3]] + np.array([500_000_000, 1_900_000_000, 0], np.int32)
    write(path, whole, (0.0, 0.0, 0.0))
    scan = read_scan(path)
    steps = np.diff(scan.xyz, axis=0)
    np.testing.assert_allclose(steps, np.diff(whole.astype(float), axis=0) / 1000, atol=1e-5)
    assert scan.valid.sum() >= 2
    write_scan(tmp_path / "copy.las", scan)
    assert (tmp_path / "copy.las").read_bytes() == path.read_bytes()


def test_survey_points_in_many_chunks_come_back(tmp_path) -> None:
    path = tmp_path / "scan.laz"
    whole = np.random.default_rng(0).integers(-(10**6), 10**6, (120_000, 3)).astype(np.int32)
    write(path, whole)
    scan = read_scan(path)
    np.testing.assert_array_equal(np.rint(scan.xyz * 1000), whole)


def test_what_no_las_can_hold_is_refused(tmp_path) -> None:
    path = tmp_path / "scan.las"
    write(path, STREET)
    scan = read_scan(path)
    lost = Scan(
        scan.xyz, fields={**scan.fields, "x": np.array([0, 0, np.nan, 0])}, header=scan.header
    )
    for other, reason in (
        (lost, "a coordinate is beyond what the file can hold"),
        (Scan(scan.xyz), r"only a scan read from a \.las"),
        (Scan(scan.xyz, header=scan.header), r"only a scan read from a \.las"),
        (with_column(scan, "word", np.array(["a"] * 4)), "has no place for the column"),
        (with_column(scan, "n" * 33, np.zeros(4)), "has no place for the column"),
    ):
        with pytest.raises(InputError, match=reason):
            write_scan(tmp_path / "copy.las", other)
    assert not (tmp_path / "copy.las").exists()


@pytest.mark.parametrize("suffix", [*SUFFIXES, ".feather"])
def test_a_library_that_is_not_installed_is_named(tmp_path, monkeypatch, suffix) -> None:
    library, path = FORMATS[suffix].EXTRA.library, tmp_path / f"scan{suffix}"
    monkeypatch.setitem(sys.modules, library, None)
    path.write_bytes(b"anything")
    for use in (read_scan, lambda path: write_scan(path, Scan(np.ones((1, 3), np.float32)))):
        with pytest.raises(MissingExtraError) as refusal:
            use(path)
        assert refusal.value.name == library


@pytest.mark.parametrize("suffix", SUFFIXES)
def test_a_further_column_becomes_an_extra_dimension(tmp_path, suffix) -> None:
    path = tmp_path / f"scan{suffix}"
    las = write(path, STREET)
    scan = read_scan(path)
    column = np.array([0, 0.25, 0.5, 1], np.float32)
    write_scan(tmp_path / f"more{suffix}", with_column(scan, "rain_probability", column))
    more = laspy.read(tmp_path / f"more{suffix}")
    np.testing.assert_array_equal(more.rain_probability, column)
    for name in las.points.array.dtype.names:
        np.testing.assert_array_equal(more.points.array[name], las.points.array[name])
    assert [record.record_data for record in more.vlrs.get_by_id("derain", (7,))] == [b"kept"]
    # The scan is as it was, and so is what is written of it.
    write_scan(tmp_path / f"copy{suffix}", scan)
    assert (tmp_path / f"copy{suffix}").read_bytes() == path.read_bytes()


def test_fewer_points_than_the_header_states_are_refused(tmp_path) -> None:
    path = tmp_path / "scan.las"
    survey = write(path, STREET, version="1.2")
    path.write_bytes(path.read_bytes()[: -survey.header.point_format.size])
    with pytest.raises(InputError, match=r"cannot be read as \.las"):
        read_scan(path)
