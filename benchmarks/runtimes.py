"""Times one model by every runtime, networks alone and in turns, and counts different labels.

    python -m pip install 'derain[openvino]'
    python benchmarks/runtimes.py model.onnx sample.bin --threads 2
    python benchmarks/runtimes.py model.onnx sample.bin --threads 2 --sizes 20

With --sizes, a stream of scans of different sizes follows: the scan without some of its points, no
size twice, as scans of a recording come.
"""

import argparse
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import torch
from torch import Tensor
from turns import milliseconds_in_turns

from derain.errors import InputError
from derain.export.proof import FINITE, prove
from derain.export.runtime import Derainer
from derain.export.runtimes.session import DEFAULT_RUNTIME
from derain.export.timing import versions
from derain.files import read_scan
from derain.scan import Scan
from derain.views.view import ViewedScan

RUNTIMES = ((DEFAULT_RUNTIME, "float32"), ("openvino", "float32"), ("openvino", "bf16"))

# Share of the points that the smallest scan of a stream lacks.
FEWER = 0.2


def main() -> None:
    """Prints medians, their ratios to onnxruntime's, and how many labels differ."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("model", type=Path)
    parser.add_argument("scan", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=8)
    parser.add_argument("--sizes", type=int, default=0, help="scans of other sizes (default: none)")
    arguments = parser.parse_args()

    derainers = {}
    for runtime, precision in RUNTIMES:
        try:
            derainer = Derainer(arguments.model, arguments.threads, runtime, precision)
        except InputError as error:  # not installed, or no such precision here
            print(error)
        else:
            derainers[str(derainer.runtime)] = derainer
    scan, usual = read_scan(arguments.scan), derainers[DEFAULT_RUNTIME]

    view = usual.view(scan)
    networks = {name: _network(derainer, [view]) for name, derainer in derainers.items()}
    print(f"{arguments.model.name}: {view.size:,} points or pixels, {arguments.threads} threads")
    _report(milliseconds_in_turns(networks, arguments.rounds, runs=3), DEFAULT_RUNTIME)

    def by_usual(**tensors: Tensor) -> Tensor:
        inputs = {title: tensor.numpy() for title, tensor in tensors.items()}
        return torch.from_numpy(usual.session.run(inputs))

    for name, derainer in derainers.items():
        scans = [(scan.name, scan)]
        found = prove(by_usual, arguments.model, scans, FINITE, derainer.runtime)
        print(
            f"  {name:20} largest logit difference {found.worst.difference:.1e}, {found.flipped} "
            f"labels flipped, IoU of the rain {found.rain_iou:.4f}"
        )
    if arguments.sizes:
        print(f"{arguments.sizes} scans of different sizes, each once")
        views = [usual.view(part) for part in _parts(scan, arguments.sizes)]
        streams = {name: _network(derainer, views) for name, derainer in derainers.items()}
        _report(milliseconds_in_turns(streams, 1, runs=len(views), warm_up=0), DEFAULT_RUNTIME)
    print(versions(derainer.runtime.name for derainer in derainers.values()))


def _network(derainer: Derainer, views: list[ViewedScan]) -> Callable[[], object]:
    """Judges one view after the other, the first again after the last."""
    inputs = [view.inputs() for view in views]
    calls = iter(range(10**9))
    return lambda: derainer.session.run(inputs[next(calls) % len(inputs)])


def _parts(scan: Scan, number: int) -> list[Scan]:
    """The scan without some points, of as many different sizes, in no order."""
    generator = np.random.default_rng(0)
    sizes = np.linspace((1 - FEWER) * len(scan), len(scan) - 1, number).astype(int)
    return [
        scan.take(generator.permutation(len(scan)) < size) for size in generator.permutation(sizes)
    ]


def _report(times: Mapping[str, list[float]], first: str) -> None:
    usual = float(np.median(times[first]))
    for name, values in times.items():
        low, median, high = np.percentile(values, [10, 50, 90])
        print(
            f"  {name:20} p10 {low:7.1f}  p50 {median:7.1f}  p90 {high:7.1f} ms, "
            f"{usual / median:.2f} times as fast as {first}"
        )


if __name__ == "__main__":
    main()
