"""Measures the gain of each cue of the model that comes with derain: scores after each step.

    python -m benchmarks.cues --shared ../shared

Prints the IoU at the model's threshold by geometry alone, after brightness is weighed once and
twice, and on scans without intensities, which have no brightness.
"""

import argparse
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np
import torch
from numpy.typing import NDArray

from benchmarks.across_sensors import PLAN
from benchmarks.sensor_table.inputs import DataFinder
from benchmarks.sensor_table.plan import Plan
from derain.default import default_checkpoint
from derain.evaluation.scores import score
from derain.evaluation.text_tables import markdown_table
from derain.models.checkpoint import load_model
from derain.models.cues import CueFusion
from derain.scan import Scan

STEPS = ("geometry alone", "brightness weighed once", "twice: the model")
WITHHELD = "the model, without intensities"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shared", type=Path, default=Path("../shared"), help="scans")
    parser.add_argument(
        "--work", type=Path, default=Path("runs/across_sensors"), help="what is made on the way"
    )
    arguments = parser.parse_args()
    model = load_model(default_checkpoint()).eval()
    assert isinstance(model, CueFusion)
    plan, rows = Plan.of_yaml(PLAN), []
    finder = DataFinder(arguments.shared, arguments.work / "simulated")
    for title, data in plan.labelled.items():
        if data.taken:
            continue
        found = finder.measured(data)
        methods = [partial(_answer, model, step) for step in range(len(STEPS) + 1)]
        scores = score(methods, map(found.reader.read, found.frames), found.card, found.distinct)
        rows.append([title, *(f"{each.pooled.iou:.3f}" for each in scores)])
    print(markdown_table(["data", *STEPS, WITHHELD], rows))


def _answer(model: CueFusion, step: int, scan: Scan) -> NDArray[np.bool_]:
    """True for points that are rain after a step, or at last without intensities, bool (N,)."""
    if step == len(STEPS):
        scan = replace(scan, intensity=None)
    view = model.spec.make_view()(scan)
    inputs = {name: torch.from_numpy(array) for name, array in view.inputs().items()}
    own = {name: inputs[name][0] for name in ("step", "counts")}
    with torch.no_grad():
        answers = model.network.answers(**(inputs | own))
    answer = answers[step if step < len(STEPS) - 1 else -1]
    return view.back(answer.sigmoid().numpy()) > model.spec.threshold


if __name__ == "__main__":
    main()
