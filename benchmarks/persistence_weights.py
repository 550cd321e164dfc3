"""Fits the weights of rays and surroundings to simulated drives, whose truth is known.

    for sensor in spinning_64_far spinning_64 mems_64; do
      derain simulate --layout street --speed 13 --traffic 10 --sensor $sensor \
        --rain 0 25 100 400 --sequences 4 --scans 4 --seed 1 --out drives/$sensor
    done
    derain simulate --layout street --speed 0 --traffic 10 --sensor spinning_64_far \
      --rain 0 25 100 400 --sequences 4 --scans 4 --seed 2 --out drives/standing
    python benchmarks/persistence_weights.py drives/*

Prints what stands in derain/recordings/evidence.py: logistic regressions on what other scans'
rays show, and on how points lie in their own scan, each alone. Every scan counts as much as the
others, whatever its number of points. And what stands in export/recorded.py: what rays add to the
log-odds of the model that comes with derain, at the points of which it is in doubt, by each of
HALVES: the one of the least loss stands there.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from scipy.optimize import minimize
from sklearn.linear_model import LogisticRegression

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import named_scans
from derain.export.recorded import DOUBTFUL, solidity
from derain.export.runtime import Derainer
from derain.recordings.evidence import ScanPoints, surroundings_features
from derain.recordings.rays import RayEvidence, mean_evidence
from derain.scan import Bools, Float32s, Floats
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.system.cores import usable_cores
from derain.views.morton import distinct_rows

# Log-odds of rain, of the end of a ray, that may count half as something solid.
HALVES = (0.0, 0.5, 1.0, 1.5, 2.0)


@dataclass(frozen=True)
class Described:
    """The features of the M points of one scan.

    Attributes:
        rays: Where rays of other scans end, and where they went through.
        rays_to_solid: The same by each of HALVES: the likelier the model takes the end of a ray for
            rain, the less it counts as solid.
        surroundings: How the points lie, float64 (M, 10).
        alone: Probability of rain by the model that comes with derain, float32 (M,).
        rain: The truth, bool (M,).
    """

    rays: RayEvidence
    rays_to_solid: list[RayEvidence]
    surroundings: Floats
    alone: Float32s
    rain: Bools


def main() -> None:
    """Prints the weights."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("roots", nargs="+", type=Path, help="simulated data sets")
    roots = parser.parse_args().roots
    scans = list(_described(roots))
    rain = np.concatenate([scan.rain for scan in scans])
    weight = np.concatenate([np.full(len(scan.rain), 1 / len(scan.rain)) for scan in scans])
    weight *= len(rain) / len(scans)
    share = float(np.mean([scan.rain.mean() for scan in scans]))
    rays = np.concatenate([_columns(scan.rays) for scan in scans])
    surroundings = np.concatenate([scan.surroundings for scan in scans])
    print(f"{len(scans)} scans, {share:.2%} rain")
    print("RAY_WEIGHTS =", _fitted(rays, rain, weight))
    print("SURROUNDINGS_WEIGHTS =", _fitted(surroundings, rain, weight))
    print(f"PRIOR = {np.log(share / (1 - share)):.2f}")
    for half, *to_solid in zip(HALVES, *(scan.rays_to_solid for scan in scans), strict=True):
        loss, weights = _added(scans, to_solid)
        print(f"HALF_SOLID = {half}: OF_ENDING, OF_THROUGH = {weights}, loss {loss:.6f}")


def _described(roots: list[Path]) -> Iterator[Described]:
    """The features of each scan that has others before and after it."""
    card, model = load_card("simulated"), Derainer()
    data = named_scans(roots, card, Loading())
    for recording in recordings_of(data.source("test")):
        scans = [data.reader.read(frame) for frame in recording]
        points = [ScanPoints(scan, usable_cores()) for scan in scans]
        rows = [distinct_rows(scan)[0] for scan in scans]
        alone = [model.judge(scan) for scan in scans]
        ends = [judged.probability[first] for judged, first in zip(alone, rows, strict=True)]
        solid = [[solidity(one, half) for one in ends] for half in HALVES]
        for place in range(1, len(recording) - 1):
            yield Described(
                _evidence(recording, points, place),
                [_evidence(recording, points, place, of_scans) for of_scans in solid],
                surroundings_features(points[place]),
                ends[place],
                card.rain_of(scans[place])[rows[place]],
            )


def _evidence(
    recording: list[Frame], points: list[ScanPoints], place: int, solid: list[Floats] | None = None
) -> RayEvidence:
    """The evidence of the rays of the scans before and after at the points of a scan."""
    own, found = points[place], []
    for other in (place - 1, place + 1):
        to_other = np.linalg.inv(_pose(recording[other])) @ _pose(recording[place])
        of_other = None if solid is None else solid[other]
        found.append(own.evidence_of(points[other], to_other, of_other))
    return mean_evidence(found)


def _columns(evidence: RayEvidence) -> Floats:
    """One, what ends, and what goes through, float64 (M, 3)."""
    return np.stack([np.ones_like(evidence.ending), evidence.ending, evidence.through], axis=1)


def _added(scans: list[Described], rays: list[RayEvidence]) -> tuple[float, tuple[float, ...]]:
    """Loss and weights of what rays add to the model's log-odds where it is in doubt."""
    doubted = [scan.alone > DOUBTFUL for scan in scans]
    of_scans = list(zip(scans, doubted, strict=True))
    of_rays = zip(rays, doubted, strict=True)
    columns = np.concatenate([_columns(evidence)[rows, 1:] for evidence, rows in of_rays])
    alone = np.concatenate([scan.alone[rows] for scan, rows in of_scans]).astype(np.float64)
    rain = np.concatenate([scan.rain[rows] for scan, rows in of_scans])
    weight = np.concatenate([np.full(rows.sum(), 1 / max(rows.sum(), 1)) for rows in doubted])
    alone = alone.clip(1e-9, 1 - 1e-9)
    before = np.log(alone / (1 - alone))

    def loss(weights: Floats) -> tuple[float, Floats]:
        log_odds = before + columns @ weights
        error = weight * (1 / (1 + np.exp(-log_odds)) - rain)
        of_points = np.logaddexp(0, log_odds) - rain * log_odds
        return float(weight @ of_points), error @ columns

    fitted = minimize(loss, np.zeros(2), jac=True)
    return fitted.fun / weight.sum(), tuple(float(round(each, 2)) for each in fitted.x)


def _pose(frame: Frame) -> Floats:
    pose = frame.pose
    assert pose is not None  # simulated drives have poses
    return pose


def _fitted(evidence: Floats, rain: Bools, weight: Floats) -> tuple[float, ...]:
    """Weights of a logistic regression, of which the first column is the constant."""
    model = LogisticRegression(fit_intercept=False, max_iter=1000).fit(evidence, rain, weight)
    return tuple(float(round(each, 2)) for each in model.coef_[0])


if __name__ == "__main__":
    main()
