"""``derain run`` writes what it removes, and how probable rain is, in the input's format."""

from dataclasses import replace
from pathlib import Path

import laspy
import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan, write_scan
from derain.scan import Scan

NAMED = (".pcd", ".ply", ".npz", ".feather", ".csv", ".xyz")


def write(path: Path) -> Scan:
    """A scan of 300 points with a column of its own."""
    points = scene(300)
    columns = dict(zip(("x", "y", "z", "intensity"), points.T, strict=True))
    ring = np.arange(300, dtype=np.uint16)
    write_scan(path, replace(Scan.of(points), fields={**columns, "ring": ring}))
    return read_scan(path)


def las(path: Path) -> Scan:
    """The same in whole millimetres."""
    points = scene(300)
    header = laspy.LasHeader(version="1.4", point_format=6)
    header.scales = [0.001] * 3
    data = laspy.LasData(header)
    data.x, data.y, data.z = points[:, :3].T.astype(np.float64)
    data.intensity = points[:, 3].astype(np.uint16)
    data.write(str(path))
    return read_scan(path)


@pytest.mark.parametrize("suffix", [".bin", *NAMED])
def test_cleaned_and_removed_together_are_the_scan(
    run_derain, onnx_model: Path, tmp_path: Path, suffix: str
) -> None:
    path, out, removed = tmp_path / f"scan{suffix}", tmp_path / "out", tmp_path / "removed"
    if suffix == ".bin":
        scene(300).tofile(path)
        scan = read_scan(path)
    else:
        scan = write(path)
    outcome = run_derain("run", onnx_model, path, "--out", out, "--removed", removed)
    assert (outcome.code, outcome.said) == (0, [])
    rain = np.fromfile(out / "scan.label", "<u4").astype(bool)
    assert 0 < rain.sum() < 300
    assert [file.name for file in removed.iterdir()] == [path.name]
    for file, rows in ((out / path.name, ~rain), (removed / path.name, rain)):
        part = read_scan(file)
        assert list(part.fields) == list(scan.fields)
        for name, column in scan.fields.items():
            np.testing.assert_array_equal(part.fields[name], column[rows], strict=True)


@pytest.mark.parametrize("suffix", [*NAMED, ".las", ".laz"])
def test_the_probability_is_one_more_column_of_the_files(
    run_derain, onnx_model: Path, tmp_path: Path, suffix: str
) -> None:
    path, out, removed = tmp_path / f"scan{suffix}", tmp_path / "out", tmp_path / "removed"
    scan = las(path) if suffix in (".las", ".laz") else write(path)
    probability = Derainer(onnx_model).probability(scan)
    options = ("--out", out, "--removed", removed, "--probability")
    outcome = run_derain("run", onnx_model, path, *options)
    assert (outcome.code, outcome.said) == (0, [])
    rain = np.fromfile(out / "scan.label", "<u4").astype(bool)
    for file, rows in ((out / path.name, ~rain), (removed / path.name, rain)):
        part = read_scan(file)
        assert list(part.fields) == [*scan.fields, "rain_probability"]
        column = part.fields["rain_probability"]
        np.testing.assert_array_equal(column.astype(np.float32), probability[rows])
        assert column.dtype == (np.float64 if suffix in (".csv", ".xyz") else np.float32)
        for name, values in scan.fields.items():
            np.testing.assert_array_equal(part.fields[name], values[rows], strict=True)
    threshold = Derainer(onnx_model).spec.threshold
    assert (read_scan(removed / path.name).fields["rain_probability"] > threshold).all()


def test_a_scan_that_has_the_column_gets_new_values(
    run_derain, onnx_model: Path, tmp_path: Path
) -> None:
    path = tmp_path / "scan.pcd"
    scan = write(path)
    write_scan(path, replace(scan, fields={**scan.fields, "rain_probability": np.full(300, 7.0)}))
    run_derain("run", onnx_model, path, "--out", tmp_path / "out", "--probability")
    column = read_scan(tmp_path / "out/scan.pcd").fields["rain_probability"]
    assert (column <= 1).all()


def test_a_structured_array_takes_the_column_and_one_without_names_does_not(
    run_derain, refused, onnx_model: Path, tmp_path: Path
) -> None:
    points = scene(300)
    named = np.rec.fromarrays(points.T, names="x,y,z,intensity")
    np.save(tmp_path / "named.npy", np.array(named))
    arguments = ("--out", tmp_path / "out", "--probability")
    assert run_derain("run", onnx_model, tmp_path / "named.npy", *arguments).code == 0
    assert "rain_probability" in read_scan(tmp_path / "out/named.npy").fields
    np.save(tmp_path / "nameless.npy", points)
    line = refused("run", onnx_model, tmp_path / "nameless.npy", *arguments)
    assert "nameless.npy: the columns of such a file have no names" in line


def test_a_file_without_names_of_columns_is_refused_once_and_before_any_work(
    run_derain, onnx_model: Path, tmp_path: Path
) -> None:
    scans = tmp_path / "scans"
    scans.mkdir()
    for number in range(3):
        scene(100).tofile(scans / f"{number}.bin")
    outcome = run_derain("run", onnx_model, scans, "--out", tmp_path / "out", "--probability")
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.said == [
        f"derain: {scans / '0.bin'}: the columns of such a file have no names, so that none can "
        "be rain_probability. Leave --probability out, or convert the scans, to .pcd or .npz for "
        "instance."
    ]
    assert not (tmp_path / "out").exists()


def test_a_filter_has_no_probabilities(run_derain, tmp_path: Path) -> None:
    write(tmp_path / "scan.pcd")
    outcome = run_derain(
        "run", "dror", tmp_path / "scan.pcd", "--out", tmp_path / "out", "--probability"
    )
    assert outcome.code == 2
    assert outcome.said == [
        "derain: --probability: dror says which points are rain, and not how probably. Leave it "
        "out, or take a model or persistence."
    ]


def test_removed_points_never_take_the_place_of_anything(
    run_derain, onnx_model: Path, tmp_path: Path
) -> None:
    scans, out = tmp_path / "scans", tmp_path / "out"
    scans.mkdir()
    scene(100).tofile(scans / "0.bin")
    before = (scans / "0.bin").read_bytes()
    outcome = run_derain("run", onnx_model, scans, "--out", out, "--removed", scans)
    assert outcome.code == 2
    assert f"would overwrite {scans / '0.bin'}. Give --removed another folder." in outcome.err
    outcome = run_derain("run", onnx_model, scans, "--out", out, "--removed", out / "." / "x/..")
    assert outcome.code == 2
    assert "where the cleaned scans go" in outcome.err
    assert (scans / "0.bin").read_bytes() == before
    assert not out.exists()
