"""Estimates the gain of a 4D radar for the default model: distances of detections to mistakes.

    python -m benchmarks.radar_cue --work runs/radar_cue

A radar would be a cue if what it detects were nearer to solid points than to rain of which the
model is not sure. Of simulated scans, fused with a radar's detections, this prints the share of
points within a distance of a detection, by what the model makes of them; and the highest IoU when
one number is added to the log-odds of points near a detection and another to all others, both
chosen by the labels: more than any cue of that kind can reach.
"""

import argparse
import itertools
import subprocess
from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np
from scipy.spatial import cKDTree
from scipy.special import logit

from benchmarks.processes import DERAIN
from derain.cards.card import load_card
from derain.evaluation.text_tables import markdown_table
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import read_labels
from derain.scan import Bools, Floats

SIMULATED = {
    "streets, mems_256": "--layout street --sequences 9 --scans 1 --rain 10 25 50",
    "streets, mems_64": "--layout street --sequences 9 --scans 1 --rain 10 25 50 --sensor mems_64",
    "facility": "--sequences 6 --scans 1 --rain 10 25 50",
}
WITHIN = 1.0  # metres
ADDED = np.arange(-3, 3.1, 0.5)

# Log-odds by the model, whether a detection is near, and whether it is rain: of every LiDAR point.
Points = tuple[Floats, Bools, Bools]


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--work", type=Path, default=Path("runs/radar_cue"), help="what is made")
    arguments = parser.parse_args()
    derainer, rows = Derainer("default", threads=2), []
    threshold = float(logit(derainer.spec.threshold))
    for number, (title, options) in enumerate(SIMULATED.items()):
        folder = arguments.work / str(number)
        subprocess.run([DERAIN, "simulate", "--out", folder, *options.split()], check=True)
        points = _points(derainer, folder)
        log_odds, near, rain = points
        called = log_odds > threshold
        kinds = (rain & called, rain & ~called, ~rain & called, ~rain & ~called)
        shares = [f"{np.mean(near[kind]):.3f}" if kind.any() else "-" for kind in kinds]
        by_constant = _best(points, threshold, [(added, added) for added in ADDED])
        by_radar = _best(points, threshold, itertools.product(ADDED, ADDED))
        rows.append([title, *shares, f"{_iou(called, rain):.4f}", by_constant, by_radar])
    titles = ["rain, found", "rain, missed", "solid, taken", "solid, kept"]
    best = ["IoU", "one number added", "by radar, two numbers"]
    print(markdown_table(["data", *titles, *best], rows))


def _points(derainer: Derainer, folder: Path) -> Points:
    card, parts = load_card("simulated"), []
    for path in sorted(folder.glob(f"sequences/*/{card.layout.lidar}/*.bin")):
        sequence, lidar = path.parent.parent, read_scan(path)
        merged = read_scan(sequence / card.layout.scans / path.name)
        labels = read_labels(sequence / card.layout.labels / f"{path.stem}.label", len(merged))
        detections = merged.xyz[len(lidar) :]
        log_odds = logit(derainer.probability(lidar).astype(np.float64).clip(1e-9, 1 - 1e-9))
        distance = np.full(len(lidar), np.inf)
        if len(detections):
            distance[lidar.valid] = cKDTree(detections).query(lidar.xyz[lidar.valid])[0]
        rain = card.rain_of(replace(lidar, label=labels[: len(lidar)]))
        parts.append((log_odds, distance < WITHIN, rain))
    log_odds, near, rain = (np.concatenate(part) for part in zip(*parts, strict=True))
    return log_odds, near, rain


def _best(points: Points, threshold: float, pairs: Iterable[tuple[float, float]]) -> str:
    """The highest IoU, and the numbers that are added near a detection and elsewhere for it."""
    log_odds, near, rain = points
    scores = {
        (here, elsewhere): _iou(log_odds + np.where(near, here, elsewhere) > threshold, rain)
        for here, elsewhere in pairs
    }
    here, elsewhere = max(scores, key=lambda pair: scores[pair])
    return f"{scores[here, elsewhere]:.4f} ({here:g}, {elsewhere:g})"


def _iou(called: Bools, rain: Bools) -> float:
    return np.count_nonzero(called & rain) / max(np.count_nonzero(called | rain), 1)


if __name__ == "__main__":
    main()
