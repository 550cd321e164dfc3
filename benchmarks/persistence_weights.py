"""Fits the weights of persistence to simulated drives, whose truth is known.

    for sensor in spinning_64_far spinning_64 mems_64; do
      derain simulate --layout street --speed 13 --traffic 10 --sensor $sensor \
        --rain 0 25 100 400 --sequences 4 --scans 4 --seed 1 --out drives/$sensor
    done
    derain simulate --layout street --speed 0 --traffic 10 --sensor spinning_64_far \
      --rain 0 25 100 400 --sequences 4 --scans 4 --seed 2 --out drives/standing
    python benchmarks/persistence_weights.py drives/*

Prints what stands in derain/recordings/evidence.py: logistic regressions on what other scans'
rays say, and on how points lie in their own scan, each alone. Every scan counts as much as the
others, whatever its number of points.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from sklearn.linear_model import LogisticRegression

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import named_scans
from derain.recordings.evidence import mean_evidence, ray_evidence, surroundings_features
from derain.recordings.known_points import ScanPoints
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.system.cores import usable_cores

# What is known of the points of one scan: by rays, (M, 3), and of themselves, (M, 10), and the
# truth, bool (M,).
Described = tuple[NDArray[np.float64], NDArray[np.float64], NDArray[np.bool_]]


def main() -> None:
    """Prints the weights."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("roots", nargs="+", type=Path, help="simulated data sets")
    roots = parser.parse_args().roots
    rays, surroundings, truth = zip(*_described(roots), strict=True)
    rain = np.concatenate(truth)
    weight = np.concatenate([np.full(len(each), 1 / len(each)) for each in truth])
    weight *= len(rain) / len(truth)
    share = float(np.mean([each.mean() for each in truth]))
    print(f"{len(truth)} scans, {share:.2%} rain")
    print("RAY_WEIGHTS =", _fitted(np.concatenate(rays), rain, weight))
    print("SURROUNDINGS_WEIGHTS =", _fitted(np.concatenate(surroundings), rain, weight))
    print(f"PRIOR = {np.log(share / (1 - share)):.2f}")


def _described(roots: list[Path]) -> Iterator[Described]:
    """What is known of each scan that has others before and after it."""
    card = load_card("simulated")
    data = named_scans(roots, card, Loading())
    for recording in recordings_of(data.source("test")):
        scans = [data.read(frame) for frame in recording]
        points = [ScanPoints.of(scan, usable_cores()) for scan in scans]
        for place in range(1, len(recording) - 1):
            first = _first_rows(points[place])
            rain = card.rain_of(scans[place])[first]
            yield (*_told(recording, points, place), rain)


def _told(
    recording: list[Frame], points: list[ScanPoints], place: int
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """What rays say of the points of a scan, and how they lie."""
    own = points[place]
    evidence = mean_evidence(
        [
            ray_evidence(
                own, points[other], np.linalg.inv(_pose(recording[other])) @ _pose(recording[place])
            )
            for other in (place - 1, place + 1)
        ]
    )
    rays = np.stack([np.ones(len(own)), evidence.ending, evidence.through], axis=1)
    return rays, surroundings_features(own)


def _pose(frame: Frame) -> NDArray[np.float64]:
    pose = frame.pose
    assert pose is not None  # simulated drives have poses
    return pose


def _first_rows(points: ScanPoints) -> NDArray[np.int64]:
    """A row of the scan at each point, int64 (M,)."""
    rows = np.zeros(len(points), np.int64)
    of_rows = np.flatnonzero(points.inverse >= 0)
    rows[points.inverse[of_rows]] = of_rows
    return rows


def _fitted(
    told: NDArray[np.float64], rain: NDArray[np.bool_], weight: NDArray[np.float64]
) -> tuple[float, ...]:
    """Weights of a logistic regression, of which the first column is the constant."""
    model = LogisticRegression(fit_intercept=False, max_iter=1000).fit(told, rain, weight)
    return tuple(float(round(each, 2)) for each in model.coef_[0])


if __name__ == "__main__":
    main()
