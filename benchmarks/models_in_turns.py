"""Times exported models on one scan, from file to mask, while they take turns.

    python benchmarks/models_in_turns.py scan.bin salsanext.onnx lite.onnx int8.onnx --threads 2

Ratios are medians over the rounds of what the first model took, over what another took in the same
round: what else the machine does slows both alike.
"""

import argparse
from pathlib import Path

import numpy as np

from derain.export.runtime import Derainer
from derain.export.timing import versions
from derain.files import read_scan
from derain.system.stopwatch import Stopwatch


def main() -> None:
    """Prints a line a model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("models", type=Path, nargs="+")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=15)
    arguments = parser.parse_args()

    derainers = [Derainer(model, arguments.threads) for model in arguments.models]
    rounds = [
        [_stages(derainer, arguments.scan) for derainer in derainers]
        for _ in range(arguments.rounds + 1)
    ][1:]  # the first one fills caches, and has libraries allocate their memory
    print(f"{'milliseconds':32}" + "".join(f"{name:>9}" for name in (*rounds[0][0], "total")))
    totals = np.array([[sum(stages.values()) for stages in models] for models in rounds])
    for place, derainer in enumerate(derainers):
        medians = np.median([list(models[place].values()) for models in rounds], axis=0)
        ratio = np.median(totals[:, 0] / totals[:, place])
        columns = "".join(f"{value:9.1f}" for value in (*medians, np.median(totals[:, place])))
        print(f"{derainer.path.name:32}{columns}   x {ratio:.2f}")
    print(versions())


def _stages(derainer: Derainer, scan: Path) -> dict[str, float]:
    """Milliseconds of each stage of one run."""
    stopwatch = Stopwatch()
    with stopwatch.stage("read"):
        points = read_scan(scan)
    derainer(points, stopwatch)
    return stopwatch.milliseconds


if __name__ == "__main__":
    main()
