"""Times derain's 3D-OutDet against the published pipeline: array in, mask out, in one run.

    python benchmarks/outdet_end_to_end.py outdet_wads.pt sample.bin --threads 2

With candidates, fitted to the rain that the published weights find in labelled scans of WADS:

    python benchmarks/outdet_end_to_end.py outdet_wads.pt sample.bin --threads 2 \
        --candidates WADS/sequences/36/velodyne/*.bin
"""

import argparse
import tempfile
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import torch
from published_outdet import PublishedPipeline
from turns import milliseconds_in_turns

from derain.cards.card import DataCard, load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import labelled_scans
from derain.evaluation.counts import Counts
from derain.export.candidates import fit_network_candidates
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.export.timing import versions
from derain.models.outdet import OutDet
from derain.models.published import read_state_dict
from derain.scan import Bools, Float32s, Scan

# Runs of each method in a round.
WARM_UP, RUNS = 2, 5

Method = Callable[[Float32s], Bools]


def main() -> None:
    """Prints the medians, their ratios, and on how many points the masks differ."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", type=Path, help="published weights for WADS")
    parser.add_argument("scan", type=Path, help="float32 x y z intensity")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=6)
    parser.add_argument("--leaf-size", type=int, default=200, help="of the rival's KDTree")
    parser.add_argument("--candidates", type=Path, nargs="+", default=[], help="labelled scans")
    parser.add_argument("--card", default="wads", help="data card of the labels")
    arguments = parser.parse_args()

    torch.set_num_threads(arguments.threads)
    points = np.fromfile(arguments.scan, np.float32).reshape(-1, 4)
    weights, wads = read_state_dict(arguments.weights), load_card("wads")
    card = load_card(arguments.card)
    model = OutDet.from_published(weights, wads)
    methods: dict[str, Method] = {
        "published": PublishedPipeline(weights, wads.mean, wads.std, arguments.leaf_size),
        "derain": _deployed(model, arguments.threads),
    }
    if arguments.candidates:
        fitted = fit_network_candidates(model, _labelled(arguments.candidates, card), card)
        print(fitted)
        model.adopt(replace(model.spec, candidates=fitted.candidates))
        methods["candidates"] = _deployed(model, arguments.threads)
    _report_times(methods, points, arguments)
    _report_masks(methods, points)
    if arguments.candidates:
        _report_iou(methods, arguments.scan, card)
    print(versions())


def _deployed(model: OutDet, threads: int) -> Derainer:
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "outdet.onnx"
        export(model, path)
        return Derainer(path, threads)


def _report_times(
    methods: dict[str, Method], points: Float32s, arguments: argparse.Namespace
) -> None:
    calls = {name: lambda method=method: method(points) for name, method in methods.items()}
    times = milliseconds_in_turns(calls, arguments.rounds, RUNS, WARM_UP)
    print(f"{len(points):,} points, {arguments.threads} threads, {len(times['derain'])} runs each")
    for name, values in times.items():
        low, median, high = np.percentile(values, [10, 50, 90])
        ratio = np.median(times["published"]) / median
        print(f"{name:10} p10 {low:8.1f}  p50 {median:8.1f}  p90 {high:8.1f} ms {ratio:8.1f} times")


def _report_masks(methods: dict[str, Method], points: Float32s) -> None:
    masks = {name: method(points) for name, method in methods.items()}
    differ = int((masks["published"] != masks["derain"]).sum())
    print(f"masks of published and derain differ on {differ} points")
    if isinstance(bounded := methods.get("candidates"), Derainer):
        candidates = bounded.spec.candidates
        assert candidates is not None
        among = candidates.among(Scan.of(points))
        wrong = int((masks["candidates"] != (masks["derain"] & among)).sum())
        print(f"{among.mean():.1%} are candidates, on which the masks differ on {wrong} points")


def _report_iou(methods: dict[str, Method], path: Path, card: DataCard) -> None:
    (scan,) = _labelled([path], card)
    points, rain = np.column_stack([scan.xyz, scan.intensity]), card.rain_of(scan)
    for name, method in methods.items():
        print(f"{name:10} IoU {Counts.of(method(points), rain).iou:.4f}")


def _labelled(paths: list[Path], card: DataCard) -> list[Scan]:
    data = labelled_scans(paths, card, Loading())
    return [data.reader.read(frame) for frame in data.frames("train")]


if __name__ == "__main__":
    main()
