"""``derain view``: one scan, several methods, one picture."""

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest
from matplotlib.figure import Figure

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import write_labels
from derain.filters import DROR, FilterDerainer
from derain.pictures import comparison, scan_pictures


@pytest.fixture
def scan(tmp_path: Path, write_labelled) -> Path:
    write_labelled(tmp_path / "velodyne/7.bin", tmp_path / "labels/7.label", rain=110)
    return tmp_path / "velodyne/7.bin"


@pytest.fixture
def saved(monkeypatch: pytest.MonkeyPatch) -> list[Figure]:
    """The figures that are drawn from here on, and not written."""
    figures: list[Figure] = []
    monkeypatch.setattr(scan_pictures, "save", lambda figure, path: figures.append(figure))
    return figures


def panels(figure: Figure) -> dict[str, int]:
    """Points that are drawn from above in each panel, by its title."""
    return {
        axes.get_title(): sum(len(drawn.get_offsets()) for drawn in axes.collections)
        for axes in figure.axes
        if axes.get_title()
    }


def test_methods_are_drawn_with_and_without_truth(
    succeed, scan: Path, tmp_path: Path, onnx_model: Path, saved: list[Figure]
) -> None:
    rain = np.arange(300) >= 270
    called = {
        "net": Derainer(onnx_model)(read_scan(scan)),
        "dror": FilterDerainer(DROR())(read_scan(scan)),
        "all": np.ones(300, bool),
    }
    methods = ["--methods", f"net={onnx_model}", "dror", "all"]
    for name, card in {"truth.png": ["--card", "wads"], "none.png": []}.items():
        succeed("view", scan, *methods, *card, "--out", tmp_path / name)
    truth, bare = saved
    ious = {
        name: np.count_nonzero(found & rain) / np.count_nonzero(found | rain)
        for name, found in called.items()
    }
    assert panels(truth) == {
        "input: intensity": 300,
        "truth: 30 points of rain": 300,
        **{f"{name}: IoU {iou:.3f}": 300 for name, iou in ious.items()},
    }
    assert panels(bare) == {
        "input: intensity": 300,
        **{f"{name}: {found.sum()} points removed": 300 for name, found in called.items()},
    }
    assert truth.get_suptitle() == bare.get_suptitle() == "7.bin: 300 points"


def test_intensities_of_another_unit_are_warned_of_and_scaled(
    run_derain, scan: Path, tmp_path: Path, onnx_model: Path, saved: list[Figure]
) -> None:
    arguments = ["--methods", f"net={onnx_model}", "ssr", "--out", tmp_path / "out.png"]
    assert run_derain("view", scan, *arguments).said == []
    points = np.fromfile(scan, np.float32).reshape(-1, 4)
    (points / np.array([1, 1, 1, 256], np.float32)).tofile(scan)
    net, ssr = run_derain("view", scan, *arguments).said
    assert net.startswith(f"derain: warning: {scan}: net: mean intensity 0.")
    assert ssr.startswith(f"derain: warning: {scan}: ssr: intensities of 0..1, but 0..255")
    assert run_derain("view", scan, *arguments, "--intensity-scale", "256").said == []
    whole, small, scaled = saved
    assert panels(scaled) == panels(whole) != panels(small)


def test_points_outside_the_grid_of_a_model_are_warned_of(
    run_derain, tmp_path: Path, salsanext_onnx: Path, saved: list[Figure]
) -> None:
    scan, points = tmp_path / "high.bin", scene(400)
    points[:100, 2] = 80.0
    points.tofile(scan)
    outside = (Derainer(salsanext_onnx).view.grid.pixel(points[:, :3]) < 0).mean()
    methods = ["--methods", f"net={salsanext_onnx}", "dror"]
    outcome = run_derain("view", scan, *methods, "--out", tmp_path / "out.png")
    assert outcome.said == [
        f"derain: warning: {scan}: net: {outside:.0%} of the points lie outside the grid of WADS, "
        "and stay"
    ]
    called = Derainer(salsanext_onnx)(read_scan(scan)).sum()
    assert f"net: {called} points removed" in panels(saved[0])


def test_nothing_to_do_is_refused(refused, scan: Path) -> None:
    assert "Give --out, --window or --rerun." in refused("view", scan, "--methods", "dror")


def test_a_card_without_labels_is_refused(refused, tmp_path: Path) -> None:
    scene(20).tofile(tmp_path / "bare.bin")
    options = ["--methods", "dror", "--card", "wads", "--out", tmp_path / "out.png"]
    assert "bare.label: there is no such file" in refused("view", tmp_path / "bare.bin", *options)
    assert not (tmp_path / "out.png").exists()


def test_points_that_nobody_knows_are_not_judged(
    run_derain, scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_labels(tmp_path / "labels/7.label", np.repeat([255, 0, 3], [100, 170, 30]))
    drawn = Mock(wraps=comparison.comparison_figure)
    monkeypatch.setattr(comparison, "comparison_figure", drawn)
    options = ["--methods", "all", "--card", "rehearse3d", "--out", tmp_path / "out.png"]
    assert run_derain("view", scan, *options).code == 0
    shown, predicted, rain, title = drawn.call_args.args
    assert (len(shown), len(predicted["all"]), rain.sum()) == (200, 200, 30)
    assert title == "7.bin: 300 points"
    assert (tmp_path / "out.png").read_bytes().startswith(b"\x89PNG")
