"""The published weights, imported, exported and run here, give the published results on WADS."""

import pytest

from derain.evaluation.counts import Counts
from derain.files.labels import read_labels
from derain.scan import class_ids

FALLING_SNOW = 110


@pytest.mark.usefixtures("one_block", "short_proof")
def test_the_scores_are_the_published_ones(succeed, shared, here) -> None:
    weights, sample = shared / "oracles/outdet_wads.pt", shared / "data/wads/sample.bin"
    succeed("import-weights", "outdet", weights, "--stats", "wads", "--out", "w.ckpt")
    succeed("export", "w.ckpt", "--out", "w.onnx", "--scan", sample, "--repeats", "1")
    succeed("run", "w.onnx", sample, "--out", "cleaned", "--threads", "2")
    points = 115_881
    truth = class_ids(read_labels(sample.with_suffix(".label"), points))
    found = read_labels(here / "cleaned/sample.label", points)
    scores = Counts.of(found == 1, truth == FALLING_SNOW)
    assert scores.precision == pytest.approx(0.8950, abs=5e-4)
    assert scores.recall == pytest.approx(0.9243, abs=5e-4)
    assert scores.iou == pytest.approx(0.8339, abs=5e-4)
