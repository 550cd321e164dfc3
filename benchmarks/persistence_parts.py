"""Measures the gain of each part of persistence: IoU with all parts, and without some.

    python benchmarks/persistence_parts.py wads WADS/drive/velodyne
    python benchmarks/persistence_parts.py kitti snowykitti/velodyne
    python benchmarks/persistence_parts.py simulated drives/standing

Counts the distinct points of scans that have two before and two after them, or else one. Labels
measure alone.
"""

import argparse
from collections import defaultdict
from collections.abc import Iterator, Mapping, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import named_scans
from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import markdown_table
from derain.recordings.evidence import (
    ScanPoints,
    combined_log_odds,
    ray_log_odds,
    surroundings_log_odds,
    vote,
)
from derain.recordings.posed import with_poses
from derain.recordings.rays import RayEvidence, mean_evidence
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.system.cores import usable_cores
from derain.views.morton import distinct_rows

# Which scans are asked, by their places after the one that is judged.
WINDOWS = {"before": (-1,), "both": (-1, 1), "two": (-2, -1, 1, 2)}


def main() -> None:
    """Prints a row for each choice of parts."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("card", help="data card of the scans")
    parser.add_argument("data", nargs="+", type=Path, help="a recording or more")
    arguments = parser.parse_args()
    card = load_card(arguments.card)
    data = named_scans(arguments.data, card, Loading())
    counts: dict[str, list[Counts]] = defaultdict(list)
    for recording in recordings_of(with_poses(data.source("test"))):
        for frame, points, windows in _seen(recording):
            scan = data.read(frame)
            first, _ = distinct_rows(scan)
            rain = card.rain_of(scan)[first]
            for name, log_odds in _by_parts(points, windows):
                counts[name].append(Counts.of(log_odds > 0, rain))
    body = []
    for name, of_scans in counts.items():
        pooled = sum(of_scans[1:], of_scans[0])
        lowest = min(each.iou for each in of_scans)
        scores = (pooled.precision, pooled.recall, pooled.iou, lowest)
        body.append([name, *(f"{score:.3f}" for score in scores)])
    print(markdown_table([card.title, "P", "R", "IoU", "lowest of a scan"], body))


def _seen(
    recording: Sequence[Frame],
) -> Iterator[tuple[Frame, ScanPoints, dict[str, RayEvidence]]]:
    """Each frame that has others around it, and the evidence of each window."""
    points = [ScanPoints.of(frame.read(), usable_cores()) for frame in recording]
    most = 2 if len(recording) > 6 else 1
    for place in range(most, len(recording) - most):
        evidence = {
            step: points[place].evidence_of(
                points[place + step],
                np.linalg.inv(_pose(recording[place + step])) @ _pose(recording[place]),
            )
            for step in range(-most, most + 1)
            if step
        }
        yield (
            recording[place],
            points[place],
            {
                name: mean_evidence([evidence[step] for step in steps])
                for name, steps in WINDOWS.items()
                if evidence.keys() >= {*steps}
            },
        )


def _by_parts(
    points: ScanPoints, windows: Mapping[str, RayEvidence]
) -> Iterator[tuple[str, NDArray[np.float64]]]:
    """Log-odds of rain by each choice of parts, float64 (M,)."""
    both = windows["both"]
    yield "surroundings in its own scan", surroundings_log_odds(points)
    yield "surroundings, and the vote", vote(points, surroundings_log_odds(points))
    yield "rays of the scans before and after", ray_log_odds(both)
    yield "rays, and the vote", vote(points, ray_log_odds(both))
    yield "surroundings and rays", combined_log_odds(points, both)
    yield "… and the vote: persistence", vote(points, combined_log_odds(points, both))
    yield "… with the scan before alone", vote(points, combined_log_odds(points, windows["before"]))
    if two := windows.get("two"):
        yield "… with two before and two after", vote(points, combined_log_odds(points, two))


def _pose(frame: Frame) -> NDArray[np.float64]:
    pose = frame.pose
    assert pose is not None  # every frame was given one
    return pose


if __name__ == "__main__":
    main()
