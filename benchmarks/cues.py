"""Measures the gain and the cost of each cue of the model that comes with derain.

    python -m benchmarks.cues --shared ../shared

Exports the model with geometry alone, with brightness weighed once, and with all. Prints the IoU of
each at the model's threshold, and of the model on scans without intensities, which have no
brightness; and milliseconds from scan to mask of the WADS sample, in turns, on two threads.
"""

import argparse
import tempfile
from collections.abc import Mapping
from dataclasses import replace
from functools import partial
from pathlib import Path

import numpy as np

from benchmarks.across_sensors import PLAN
from benchmarks.sensor_table.inputs import DataFinder
from benchmarks.sensor_table.plan import Plan
from benchmarks.turns import milliseconds_in_turns
from derain.default import default_checkpoint
from derain.evaluation.scores import score
from derain.evaluation.text_tables import markdown_table
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.models.checkpoint import load_model
from derain.models.cues import CueFusion
from derain.scan import Bools, Scan

# Models by how often they weigh brightness.
TITLES = ("geometry alone", "brightness weighed once", "twice: the model")
WITHHELD = "the model, without intensities"

TIMED = "WADS sample"


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--shared", type=Path, default=Path("../shared"), help="scans")
    parser.add_argument(
        "--work", type=Path, default=Path("runs/across_sensors"), help="what is made on the way"
    )
    parser.add_argument("--rounds", type=int, default=15, help="timed runs of each model")
    arguments = parser.parse_args()
    derainers = {title: _with_rounds(rounds) for rounds, title in enumerate(TITLES)}
    methods = [*derainers.values(), partial(_without_intensity, derainers[TITLES[-1]])]
    plan, rows = Plan.of_yaml(PLAN), []
    finder = DataFinder(arguments.shared, arguments.work / "simulated")
    for title, data in plan.labelled.items():
        if data.taken:
            continue
        found = finder.measured(data)
        reader = found.reader
        scores = score(methods, map(reader.read, found.frames), reader.card, reader.distinct)
        rows.append([title, *(f"{each.pooled.iou:.3f}" for each in scores)])
        if title == TIMED:
            times = _milliseconds(derainers, reader.read(found.frames[0]), arguments.rounds)
            rows.append([f"{title}, ms", *times, "-"])
    print(markdown_table(["data", *TITLES, WITHHELD], rows))


def _with_rounds(rounds: int) -> Derainer:
    """The default model with no more than some rounds of brightness."""
    model = load_model(default_checkpoint())
    assert isinstance(model, CueFusion)
    model.network.rounds = model.network.rounds[:rounds]
    with tempfile.TemporaryDirectory() as folder:
        file = Path(folder) / "model.onnx"
        export(model, file)
        derainer = Derainer(file, threads=2)
    derainer.warns = False
    return derainer


def _without_intensity(derainer: Derainer, scan: Scan) -> Bools:
    return derainer(replace(scan, intensity=None))


def _milliseconds(derainers: Mapping[str, Derainer], scan: Scan, rounds: int) -> list[str]:
    """The median of each model, which take turns."""
    times = milliseconds_in_turns(
        {title: partial(derainer, scan) for title, derainer in derainers.items()}, rounds
    )
    return [f"{np.median(each):.0f}" for each in times.values()]


if __name__ == "__main__":
    main()
