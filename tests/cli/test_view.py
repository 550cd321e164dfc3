"""``derain view``: one scan, several methods, one picture."""

from pathlib import Path
from unittest.mock import Mock

import numpy as np
import pytest

from derain import comparison_pictures
from derain.files.labels import write_labels
from derain.hard_cases import scene


@pytest.fixture
def scan(tmp_path: Path, write_labelled) -> Path:
    write_labelled(tmp_path / "velodyne/7.bin", tmp_path / "labels/7.label", rain=110)
    return tmp_path / "velodyne/7.bin"


def test_methods_are_drawn_with_and_without_truth(
    run_derain, scan: Path, tmp_path: Path, onnx_model: Path
) -> None:
    methods = ["--methods", onnx_model, "dror", "all"]
    for name, card in {"truth.png": ["--card", "wads"], "none.png": []}.items():
        outcome = run_derain("view", scan, *methods, *card, "--out", tmp_path / name)
        assert outcome.code == 0, outcome.err
        assert (tmp_path / name).read_bytes().startswith(b"\x89PNG")
    assert (tmp_path / "truth.png").read_bytes() != (tmp_path / "none.png").read_bytes()


def test_nothing_to_do_is_refused(run_derain, scan: Path) -> None:
    outcome = run_derain("view", scan, "--methods", "dror")
    assert outcome.code == 2
    assert "nothing is to be done with it. Give --out or --window." in outcome.err


def test_a_card_without_labels_is_refused(run_derain, tmp_path: Path) -> None:
    scene(20).tofile(tmp_path / "bare.bin")
    options = ["--methods", "dror", "--card", "wads", "--out", tmp_path / "out.png"]
    outcome = run_derain("view", tmp_path / "bare.bin", *options)
    assert outcome.code == 2
    assert "bare.label: there is no such file" in outcome.err
    assert not (tmp_path / "out.png").exists()


def test_points_that_nobody_knows_are_not_judged(
    run_derain, scan: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    write_labels(tmp_path / "labels/7.label", np.repeat([255, 0, 3], [100, 170, 30]))
    drawn = Mock(wraps=comparison_pictures.comparison_figure)
    monkeypatch.setattr(comparison_pictures, "comparison_figure", drawn)
    options = ["--methods", "all", "--card", "rehearse3d", "--out", tmp_path / "out.png"]
    assert run_derain("view", scan, *options).code == 0
    shown, predicted, rain, title = drawn.call_args.args
    assert (len(shown), len(predicted["all"]), rain.sum()) == (200, 200, 30)
    assert title == "7.bin: 300 points"
