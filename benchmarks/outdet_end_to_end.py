"""Times derain's 3D-OutDet against the published pipeline: array in, mask out, in one run.

python benchmarks/outdet_end_to_end.py outdet_wads.pt sample.bin --threads 2
"""

import argparse
import tempfile
from pathlib import Path

import numpy as np
import torch
from published_outdet import PublishedPipeline
from turns import milliseconds_in_turns

from derain.cards.card import load_card
from derain.export.machine import versions
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.models.outdet import OutDet
from derain.models.published import read_state_dict

# Runs of each method in a round.
WARM_UP, RUNS = 2, 5


def main() -> None:
    """Prints both medians, their ratio, and on how many points the masks differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("weights", type=Path, help="published weights for WADS")
    parser.add_argument("scan", type=Path, help="float32 x y z intensity")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--leaf-size", type=int, default=200, help="of the rival's KDTree")
    arguments = parser.parse_args()

    torch.set_num_threads(arguments.threads)
    points = np.fromfile(arguments.scan, np.float32).reshape(-1, 4)
    weights, card = read_state_dict(arguments.weights), load_card("wads")
    with tempfile.TemporaryDirectory() as folder:
        model = Path(folder) / "outdet.onnx"
        export(OutDet.from_published(weights, card), model)
        ours = Derainer(model, arguments.threads)
    rival = PublishedPipeline(weights, card.mean, card.std, arguments.leaf_size)

    methods = {"published": lambda: rival(points), "derain": lambda: ours(points)}
    times = milliseconds_in_turns(methods, arguments.rounds, RUNS, WARM_UP)
    differ = int((rival(points) != ours(points)).sum())

    print(f"{len(points):,} points, {arguments.threads} threads, {len(times['derain'])} runs each")
    for name, values in times.items():
        low, median, high = np.percentile(values, [10, 50, 90])
        print(f"{name:10} p10 {low:8.1f}  p50 {median:8.1f}  p90 {high:8.1f} ms")
    print(f"ratio of medians {np.median(times['published']) / np.median(times['derain']):.1f}")
    print(f"masks differ on {differ} points ({differ / max(len(points), 1):.1e})")
    print(versions())


if __name__ == "__main__":
    main()
