"""``derain view``: one scan, several methods, one picture."""

from pathlib import Path

import numpy as np
import pytest
from matplotlib.figure import Figure

from derain.cli.options import picture
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import write_labels
from derain.filters import DROR, FilterDerainer


@pytest.fixture
def scan(tmp_path, write_labelled) -> Path:
    write_labelled(tmp_path / "velodyne/7.bin", tmp_path / "labels/7.label", rain=110)
    return tmp_path / "velodyne/7.bin"


def panels(figure: Figure) -> dict[str, int]:
    """Points that are drawn from above in each panel, by its title."""
    return {
        axes.get_title(): sum(len(drawn.get_offsets()) for drawn in axes.collections)
        for axes in figure.axes
        if axes.get_title()
    }


def test_methods_are_drawn_with_and_without_truth(
    succeed, scan, tmp_path, onnx_model, saved_figures
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
    truth, bare = saved_figures
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


def test_nothing_to_do_is_refused(refused, scan) -> None:
    assert "Give --out, --window or --rerun." in refused("view", scan, "--methods", "dror")


def test_a_card_without_labels_is_refused(refused, tmp_path) -> None:
    scene(20).tofile(tmp_path / "bare.bin")
    options = ["--methods", "dror", "--card", "wads", "--out", tmp_path / "out.png"]
    assert "bare.label: there is no such file" in refused("view", tmp_path / "bare.bin", *options)
    assert not (tmp_path / "out.png").exists()


def test_labels_that_are_no_classes_of_the_card_are_refused(refused, scan, tmp_path) -> None:
    options = ["--methods", "all", "--card", "kitti", "--out", tmp_path / "out.png"]
    assert "ids [110] are no classes of SnowyKITTI" in refused("view", scan, *options)
    assert not (tmp_path / "out.png").exists()


def test_points_that_nobody_knows_are_not_judged(succeed, scan, tmp_path, saved_figures) -> None:
    write_labels(tmp_path / "labels/7.label", np.repeat([255, 0, 3], [100, 170, 30]))
    options = ["--methods", "all", "--card", "rehearse3d", "--out", tmp_path / "out.png"]
    succeed("view", scan, *options)
    assert panels(saved_figures[0]) == {
        "input: intensity": 200,
        "truth: 30 points of rain": 200,
        "all: IoU 0.150": 200,
    }


def test_the_suffix_of_a_picture_may_be_in_capitals() -> None:
    assert picture("view.PNG") == Path("view.PNG")
