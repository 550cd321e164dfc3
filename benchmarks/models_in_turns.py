"""Times exported models on one scan, from file to mask, while they take turns.

    python benchmarks/models_in_turns.py scan.bin salsanext.onnx lite.onnx int8.onnx --threads 2

Ratios are medians over the rounds of what the first model took, over what another took in the same
round: what else the machine does slows both alike. With --operators, what each kind of operator
takes of the network's time, by onnxruntime's own profile.
"""

import argparse
import json
import tempfile
from collections import Counter
from pathlib import Path

import numpy as np
import onnxruntime

from derain.export.runtime import Derainer
from derain.export.timing import versions
from derain.files import read_scan
from derain.system.stopwatch import Stopwatch

PROFILED_RUNS = 5


def main() -> None:
    """Prints a line a model."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scan", type=Path)
    parser.add_argument("models", type=Path, nargs="+")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=15)
    parser.add_argument("--operators", action="store_true")
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
    if arguments.operators:
        for derainer in derainers:
            print(f"{derainer.path.name}: {_operators(derainer, arguments.scan)}")
    print(versions())


def _stages(derainer: Derainer, scan: Path) -> dict[str, float]:
    """Milliseconds of each stage of one run."""
    stopwatch = Stopwatch()
    with stopwatch.stage("read"):
        points = read_scan(scan)
    derainer(points, stopwatch)
    return stopwatch.milliseconds


def _operators(derainer: Derainer, scan: Path) -> str:
    """Share of the network's time that each kind of operator takes."""
    inputs = derainer.view(read_scan(scan)).inputs()
    options = onnxruntime.SessionOptions()
    options.intra_op_num_threads = derainer.threads
    options.enable_profiling = True
    with tempfile.TemporaryDirectory() as folder:
        options.profile_file_prefix = f"{folder}/profile"
        session = onnxruntime.InferenceSession(
            derainer.path, options, providers=["CPUExecutionProvider"]
        )
        for _ in range(PROFILED_RUNS):
            session.run(None, inputs)
        events = json.loads(Path(session.end_profiling()).read_text("utf-8"))
    times: Counter[str] = Counter()
    for event in events:
        if event["name"].endswith("_kernel_time"):
            times[event["args"]["op_name"]] += event["dur"]
    share = {name: time / times.total() for name, time in times.most_common(6)}
    return ", ".join(f"{name} {100 * part:.0f} %" for name, part in share.items())


if __name__ == "__main__":
    main()
