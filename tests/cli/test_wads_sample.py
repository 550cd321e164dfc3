"""The published weights, imported, exported and run here, give the published results on WADS."""

from pathlib import Path

import numpy as np
import pytest

from derain.cli.main import main
from derain.evaluation.counts import Counts
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import read_labels, semantic
from derain.scan import Scan

FALLING_SNOW = 110


def derain(*arguments: str | Path) -> None:
    assert main([str(argument) for argument in arguments]) == 0


@pytest.fixture(scope="module")
def folder(shared, tmp_path_factory) -> Path:
    """The three commands a user types, in a folder of its own."""
    folder = tmp_path_factory.mktemp("wads")
    weights, sample = shared / "oracles/outdet_wads.pt", shared / "data/wads/sample.bin"
    checkpoint, model = folder / "w.ckpt", folder / "w.onnx"
    derain("import-weights", "outdet", weights, "--stats", "wads", "--out", checkpoint)
    with pytest.MonkeyPatch.context() as patch:  # the whole proof has tests of its own
        patch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])
        derain("export", checkpoint, "--out", model, "--scan", sample, "--repeats", "1")
    derain("run", model, sample, "--out", folder / "cleaned", "--json", "--threads", "2")
    return folder


def test_the_scores_are_the_published_ones(folder, shared) -> None:
    points = 115_881
    truth = semantic(read_labels(shared / "data/wads/sample.label", points))
    found = read_labels(folder / "cleaned/sample.label", points)
    scores = Counts.of(found == 1, truth == FALLING_SNOW)
    assert scores.precision == pytest.approx(0.8950, abs=5e-4)
    assert scores.recall == pytest.approx(0.9243, abs=5e-4)
    assert scores.iou == pytest.approx(0.8339, abs=5e-4)


def test_the_cleaned_scan_is_the_sample_without_its_rain(folder, shared) -> None:
    rain = np.fromfile(folder / "cleaned/sample.label", "<u4") == 1
    sample = np.fromfile(shared / "data/wads/sample.bin", "<f4").reshape(-1, 4)
    assert (folder / "cleaned/sample.bin").read_bytes() == sample[~rain].tobytes()


def test_the_logits_are_those_of_the_oracle(folder, shared) -> None:
    derainer = Derainer(folder / "w.onnx")
    view = derainer.view(read_scan(shared / "data/wads/sample.bin"))
    expected = np.load(shared / "oracles/outdet_wads.npz")["logits"]
    np.testing.assert_allclose(derainer.logits(view)[view.inverse], expected, atol=1e-4, rtol=0)
