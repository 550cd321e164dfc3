"""Every hard case goes through ``derain run``: finite, defined, and no row lost."""

from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.cli.main import main
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.runtime import Derainer
from derain.files import read_scan, write_scan
from derain.scan import Scan
from derain.views.range_image import RangeView
from derain.views.spherical_grid import SphericalGrid

# A .bin file of x, y, z and intensity cannot lack the intensity.
SUFFIXES = {"no intensity": (".pcd", ".npz", ".ply")}


LARGEST = 150_000

CASES = [
    pytest.param(f"{number:02d}_{suffix[1:]}{suffix}", scan, id=f"{name}{suffix}")
    for number, (name, scan) in enumerate(hard_cases(LARGEST))
    for suffix in SUFFIXES.get(name, (".bin",))
]


@pytest.fixture(scope="module")
def cleaned(onnx_model: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Folder of the hard cases, cleaned in one run of a random network."""
    folder = tmp_path_factory.mktemp("hard")
    for case in CASES:
        name, scan = case.values
        write_scan(folder / "scans" / name, scan)
    scans, out = str(folder / "scans"), str(folder / "cleaned")
    options = ("--most-removed", "1", "--threads", "2")  # it calls most of some scans rain
    assert main(["run", str(onnx_model), scans, "--out", out, *options]) == 0
    return folder / "cleaned"


@pytest.fixture(scope="module")
def derainer(onnx_model: Path) -> Derainer:
    return Derainer(onnx_model, threads=2)


@pytest.mark.parametrize(("name", "scan"), CASES)
def test_a_hard_scan_gets_a_label_for_every_row_and_loses_only_rain(
    cleaned: Path, derainer: Derainer, name: str, scan: Scan
) -> None:
    label = np.fromfile((cleaned / name).with_suffix(".label"), "<u4")
    assert label.shape == (len(scan),)
    assert np.isin(label, [0, 1]).all()
    assert not label[~scan.valid].any()
    left = read_scan(cleaned / name)
    np.testing.assert_array_equal(left.xyz, scan.xyz[label == 0])
    probability = derainer.probability(scan)
    assert np.isfinite(probability).all()
    np.testing.assert_array_equal(label, probability > 0.5)


def test_no_hard_case_is_hard_in_name_only() -> None:
    scans = dict(hard_cases(largest=50))
    valid = {name: int(scan.valid.sum()) for name, scan in scans.items()}
    assert (len(scans["empty"]), len(scans["one point"])) == (0, 1)
    assert 1 < len(scans["fewer points than neighbours"]) < 9
    assert len(np.unique(scans["all points identical"].xyz, axis=0)) == 1
    assert len(np.unique(scans["40 % duplicates"].xyz, axis=0)) == 3000 < 5000
    assert valid["nothing valid"] == 0
    for name in ("NaN and infinite rows", "points at the origin", "sentinel cells"):
        assert valid[name] == 2700, name
    for name, reach in (("range 1e-6 m", 1e-6), ("range 1e4 m", 1e4)):
        np.testing.assert_allclose(scans[name].range, reach, rtol=1e-5)
    azimuth = np.arctan2(*scans["azimuth ±π"].xyz[:, 1::-1].T)
    assert set(azimuth) == {np.float32(np.pi), np.float32(-np.pi)}
    assert scans["no intensity"].intensity is None
    assert set(scans["intensity 0"].intensity) == {0}
    assert set(scans["intensity 65,535"].intensity) == {65_535}
    assert len(scans["50 points"]) == 50


def filled_rows(scan: Scan) -> NDArray[np.bool_]:
    """Which rows of the usual grid, 64 from 15 to -25 degrees, show a return."""
    return RangeView(SphericalGrid.even(64, 256, (-25, 15)), ())(scan).valid.any(axis=1)


def test_no_case_of_range_images_is_hard_in_name_only() -> None:
    scans = dict(hard_cases(largest=50))
    poles = scans["at the poles"]
    assert not poles.xyz[:, :2].any()
    assert {-90, 90} == set(np.degrees(np.arctan2(poles.xyz[:, 2], 0)))
    for name, empty in (
        ("a grid row without returns", slice(26, 28)),
        ("many grid rows without returns", slice(20, 56)),
    ):
        rows = filled_rows(scans[name])
        assert rows[: empty.start].any(), name
        assert not rows[empty].any(), name
        assert rows[empty.stop :].any(), name
        assert filled_rows(Scan.of(scene()))[empty].any(), name
    same = scans["constant image"]
    np.testing.assert_allclose(same.range, 10, rtol=1e-6)
    assert set(same.intensity) == {50}
    assert RangeView(SphericalGrid.even(32, 128, (-25.3, 15.3)), ())(same).valid.all()
