"""``derain run`` on files of many kinds: the scan comes back in its own, with every field."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan, write_scan
from derain.files.formats.pcd import ENCODINGS
from derain.scan import Scan


def rain_of(label_file: Path) -> NDArray[np.bool_]:
    return np.fromfile(label_file, "<u4").astype(bool)


def test_columns_are_taken_as_stated_and_all_kept(
    succeed, onnx_model: Path, tmp_path: Path
) -> None:
    points = scene(200)
    wide = np.column_stack([points, np.arange(200, dtype=np.float32)])
    wide.tofile(tmp_path / "wide.bin")
    out = tmp_path / "out"
    succeed(
        *("run", onnx_model, tmp_path / "wide.bin", "--out", out),
        *("--columns", "x,y,z,intensity,ring"),
    )
    rain = rain_of(out / "wide.label")
    np.testing.assert_array_equal(rain, Derainer(onnx_model)(points))
    assert (out / "wide.bin").read_bytes() == wide[~rain].tobytes()


def test_columns_that_do_not_fit_are_reported(run_derain, onnx_model: Path, tmp_path: Path) -> None:
    np.save(tmp_path / "wide.npy", np.ones((10, 5), np.float32))
    outcome = run_derain("run", onnx_model, tmp_path / "wide.npy", "--out", tmp_path / "out")
    assert outcome.code == 2
    assert "has 5 columns, but 4 are stated" in outcome.err
    assert "--columns" in outcome.err


@pytest.mark.parametrize("encoding", ENCODINGS)
def test_every_field_of_a_pcd_is_kept(
    run_derain, onnx_model: Path, tmp_path: Path, encoding: str
) -> None:
    points = scene(200)
    fields = {
        **dict(zip("xyz", points[:, :3].T, strict=True)),
        "intensity": points[:, 3].astype(np.uint8),
        "ring": np.arange(200, dtype=np.uint16),
        "time": np.linspace(1.7e9, 1.7e9 + 0.1, 200),
        "velocity": np.linspace(-30, 30, 200, dtype=np.float32),
    }
    source, out = tmp_path / "scan.pcd", tmp_path / "out"
    write_scan(source, Scan(points[:, :3].copy(), points[:, 3].copy(), fields=fields))
    first = read_scan(source)
    write_scan(source, replace(first, header=replace(first.header, encoding=encoding)))
    assert run_derain("run", onnx_model, source, "--out", out).code == 0
    rain = rain_of(out / "scan.label")
    assert 0 < rain.sum() < 200
    before, after = read_scan(source), read_scan(out / "scan.pcd")
    assert after.header.encoding == encoding
    assert list(after.fields) == list(fields)
    for name, column in before.fields.items():
        np.testing.assert_array_equal(after.fields[name], column[~rain], strict=True)


@pytest.mark.parametrize("suffix", [".pcd", ".npz", ".npy"])
def test_an_organised_scan_is_labelled_cell_by_cell(
    run_derain, onnx_model: Path, tmp_path: Path, suffix: str
) -> None:
    points = scene(240)
    points[::6] = np.nan  # cells without a return
    source, out = tmp_path / f"scan{suffix}", tmp_path / "out"
    write_scan(source, Scan(points[:, :3].copy(), points[:, 3].copy(), shape=(8, 30)))
    assert read_scan(source).shape == (8, 30)
    assert run_derain("run", onnx_model, source, "--out", out).code == 0
    rain = rain_of(out / "scan.label")
    np.testing.assert_array_equal(rain, Derainer(onnx_model)(points))
    assert not rain[::6].any()
    cleaned = read_scan(out / f"scan{suffix}")
    np.testing.assert_array_equal(cleaned.xyz, points[~rain, :3])
    assert cleaned.shape is None
