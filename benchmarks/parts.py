"""Times the parts of derain's 3D-OutDet against their alternatives.

    python benchmarks/parts.py checkpoint.ckpt scan.bin --threads 2

Libraries that are not installed are left out: pip install scipy pykdtree
"""

import argparse
import tempfile
from collections.abc import Callable, Mapping
from pathlib import Path

import numpy as np
import small_gicp
from libraries import installed
from numpy.typing import NDArray
from turns import milliseconds_in_turns

from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.export.timing import versions
from derain.files import read_scan
from derain.models.checkpoint import load_model
from derain.models.outdet import network
from derain.views.morton import distinct_positions

NEIGHBOURS = 9
ROUNDS = 15


def main() -> None:
    """Prints the medians, the candidates of each part taking turns."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("scan", type=Path)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()

    scan = read_scan(arguments.scan)
    xyz = scan.xyz[scan.valid]
    _report(f"kNN of {len(xyz):,} points, k = {NEIGHBOURS}", _searches(xyz, arguments.threads))

    with tempfile.TemporaryDirectory() as folder:
        networks = {}
        for blocks in (1, 16):
            network.BLOCKS = blocks
            model = Path(folder) / f"{blocks}.onnx"
            export(load_model(arguments.checkpoint), model)
            networks[f"in {blocks} blocks"] = _network(Derainer(model, arguments.threads), scan)
    _report("network", networks)
    print(versions())


def _searches(xyz: NDArray[np.float32], threads: int) -> dict[str, Callable[[], object]]:
    first, _ = distinct_positions(xyz)
    ordered = np.ascontiguousarray(xyz[first])

    def with_small_gicp(points: NDArray[np.float32]) -> Callable[[], object]:
        exact = points.astype(np.float64)
        return lambda: small_gicp.KdTree(exact, num_threads=threads).batch_knn_search(
            exact, NEIGHBOURS, num_threads=threads
        )

    def ordering_too() -> object:
        first, _ = distinct_positions(xyz)
        return with_small_gicp(xyz[first])()

    searches: dict[str, Callable[[], object]] = {
        "small_gicp, order of the file": with_small_gicp(xyz),
        "small_gicp, along the curve": with_small_gicp(ordered),
        "small_gicp, with the ordering": ordering_too,
    }
    if spatial := installed("scipy.spatial"):
        searches["SciPy cKDTree, along the curve"] = lambda: spatial.cKDTree(ordered).query(
            ordered, NEIGHBOURS, workers=threads
        )
    if pykdtree := installed("pykdtree.kdtree"):  # takes its threads from OMP_NUM_THREADS
        searches["pykdtree, along the curve"] = lambda: pykdtree.KDTree(ordered).query(
            ordered, NEIGHBOURS
        )
    return searches


def _network(derainer: Derainer, scan: object) -> Callable[[], object]:
    inputs = derainer.view(scan).inputs()
    return lambda: derainer.session.run(inputs)


def _report(title: str, candidates: Mapping[str, Callable[[], object]]) -> None:
    print(title)
    for name, values in milliseconds_in_turns(candidates, ROUNDS).items():
        print(f"  {name:32} {np.median(values):7.1f} ms")


if __name__ == "__main__":
    main()
