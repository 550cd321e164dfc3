"""``derain run`` on scans that do not suit the method: told, counted, left alone if so asked."""

import json
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import write_scan
from derain.filters import FilterDerainer
from derain.scan import Scan
from derain.sources.judgement import Judgement
from derain.views.scan_issues import MOST_RAIN
from derain.views.spherical_grid import SphericalGrid


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder of scans: ordinary, without intensity (two), and with one value of it (two)."""
    folder = tmp_path / "scans"
    folder.mkdir()
    constant = scene(200) * np.array([1, 1, 1, 0], np.float32)
    scene(200).tofile(folder / "a.bin")
    for name in "bc":
        write_scan(folder / f"{name}.pcd", Scan(scene(200)[:, :3].copy()))
    for name in "de":
        constant.tofile(folder / f"{name}.bin")
    return folder


def test_every_fault_is_told_with_its_first_file_and_counted(
    succeed, scans: Path, onnx_model: Path, tmp_path: Path
) -> None:
    outcome = succeed("run", onnx_model, scans, "--out", tmp_path / "out", "--json")
    *told, summary = outcome.said
    assert told == [
        f"derain: warning: {scans / 'b.pcd'}: no intensity: the mean of WADS, 9.88, stands in",
        f"derain: warning: {scans / 'd.bin'}: intensity 0 at every point, so that it was not "
        "measured: the mean of WADS, 9.88, stands in",
        "derain: warning: 1 more scan: no intensity",
        "derain: warning: 1 more scan: intensity not measured",
    ]
    assert summary.startswith("5 scans: 1,000 points, ")
    odd = [json.loads(line)["warnings"] for line in outcome.out.splitlines()]
    assert [any("stands in" in text for text in texts) for texts in odd] == [False, *4 * [True]]


def test_a_constant_intensity_is_judged_as_none(
    run_derain, scans: Path, onnx_model: Path, tmp_path: Path
) -> None:
    run_derain("run", onnx_model, scans, "--out", tmp_path / "out")
    first, second = (np.fromfile(tmp_path / f"out/{name}.label", "<u4") for name in "bd")
    np.testing.assert_array_equal(first, second)
    mean = scene(200)
    mean[:, 3] = Derainer(onnx_model).spec.mean_intensity
    mean[0, 3] += 1e-6  # measured, as it seems
    assert (Derainer(onnx_model)(mean) == second).all()


def test_a_method_that_takes_nearly_all_says_so(succeed, scans: Path, tmp_path: Path) -> None:
    options = ["--set", "radius=1e-6", "--out", tmp_path / "out"]
    outcome = succeed("run", "ror", scans, *options)
    assert outcome.err.splitlines() == [
        f"derain: warning: {scans / 'a.bin'}: 100% of the points are called rain, where the "
        "heaviest rain has 17%: the method may not suit the sensor",
        "derain: warning: 4 more scans: more than 35% called rain",
    ]
    *lines, summary = outcome.out.splitlines()
    assert all("200 points, 200 valid, 200 of rain (100.0% of the valid), " in x for x in lines)
    assert summary.startswith("5 scans: 1,000 points, 1,000 valid, 1,000 of rain (100.0% of ")
    assert summary.endswith("; 5 scans with warnings")


@pytest.mark.parametrize("options", [[], ["--most-removed", "0.99"]])
def test_a_scan_that_would_lose_too_much_is_left_whole(
    run_derain, tmp_path: Path, scans: Path, monkeypatch: pytest.MonkeyPatch, options: list[str]
) -> None:
    monkeypatch.setattr("derain.cli.run.MOST_RAIN", MOST_RAIN)
    spread = scene(200) * np.array([1e3, 1e3, 1e3, 1], np.float32)
    spread.tofile(scans / "c.bin")
    (scans / "c.pcd").unlink()
    out = tmp_path / "out"
    outcome = run_derain("run", "ror", scans, "--set", "radius=20", "--out", out, *options)
    assert outcome.code == 2
    refused, summary = outcome.err.splitlines()[-2:]
    assert refused.startswith(f"derain: {scans / 'c.bin'}: left whole, for 100.0% of its valid")
    assert summary == "derain: 1 of 5 scans could not be cleaned"
    assert sorted(path.stem for path in out.glob("*.label")) == ["a", "b", "d", "e"]
    assert not list(out.glob("c.*"))


@pytest.mark.parametrize("share", ["1.01", "-0.1", "nan"])
def test_a_share_that_is_none_is_refused(refused, scans: Path, tmp_path: Path, share: str) -> None:
    line = refused("run", "ror", scans, "--out", tmp_path / "out", f"--most-removed={share}")
    assert f"--most-removed: {share} is not a number from 0 to 1" in line


def test_a_scan_is_projected_once_and_in_the_time_that_is_told(
    succeed, salsanext_onnx: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    points = scene(400)
    points[:100, 2] = 80.0  # above the grid
    points.tofile(tmp_path / "scan.bin")
    projected, pixel = [], SphericalGrid.pixel

    def counting(grid: SphericalGrid, xyz: NDArray[np.float32]) -> NDArray[np.int64]:
        projected.append(len(xyz))
        return pixel(grid, xyz)

    monkeypatch.setattr(SphericalGrid, "pixel", counting)
    outcome = succeed("run", salsanext_onnx, tmp_path / "scan.bin", "--out", tmp_path / "out")
    assert [points for points in projected if points] == [400]  # of none when a model is opened
    grid = Derainer(salsanext_onnx).view.grid
    outside = (grid.pixel(points[:, :3]) < 0).mean()
    assert outside > 0.2
    assert outcome.said == [
        f"derain: warning: {tmp_path / 'scan.bin'}: {outside:.0%} of the points lie outside the "
        "grid of WADS, and stay"
    ]


def test_parts_of_a_file_that_are_not_written_are_named(succeed, tmp_path: Path) -> None:
    points = "\n".join(f"{x} {y} {x * y % 7}" for x in range(1, 4) for y in range(40))
    scan = tmp_path / "mesh.ply"
    scan.write_text(
        "ply\nformat ascii 1.0\nelement vertex 120\nproperty float x\nproperty float y\n"
        "property float z\nelement edge 1\nproperty int a\nproperty int b\nend_header\n"
        f"{points}\n0 1\n"
    )
    outcome = succeed("run", "ror", scan, "--out", tmp_path / "out")
    assert outcome.said == [f"derain: warning: {scan}: the cleaned file is without its edge"]


@pytest.mark.parametrize("command", ["run dror", "info"])
def test_a_file_without_points_is_warned_of(succeed, tmp_path: Path, command: str) -> None:
    scan = tmp_path / "empty.bin"
    scan.touch()
    out = ("--out", tmp_path / "out") if command != "info" else ()
    outcome = succeed(*command.split(), scan, *out)
    (warning,) = outcome.err.splitlines()
    assert warning.startswith(f"derain: warning: {scan}: it holds no points")


def test_a_scan_for_which_the_memory_is_too_small_does_not_end_the_run(
    run_derain, scans: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    judge = FilterDerainer.judge

    def judge_if_small(self: FilterDerainer, scan: Scan, *more: Any) -> Judgement:
        if scan.name.endswith("a.bin"):
            raise MemoryError
        return judge(self, scan, *more)

    monkeypatch.setattr(FilterDerainer, "judge", judge_if_small)
    outcome = run_derain("run", "dror", scans, "--out", tmp_path / "out")
    assert outcome.code == 2
    assert f"derain: {scans / 'a.bin'}: needs more memory than there is" in outcome.err
    assert {path.stem for path in (tmp_path / "out").glob("*.label")} == {*"bcde"}
