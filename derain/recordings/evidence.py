"""What speaks for rain at each point: other scans' rays, and its surroundings in its own scan.

Both are weighed as witnesses who do not know of each other: log-odds of each alone, added. Their
weights are fitted to simulated drives (``benchmarks/persistence_weights.py``), whose truth is
known: no label of a real scan had a part in them. Intensity is not asked for.
"""

import numpy as np
from numpy.typing import NDArray

from derain.recordings.known_points import ScanPoints
from derain.recordings.seen_through import RayEvidence
from derain.recordings.surroundings import surroundings_features

# Log-odds of rain: of any point; for each share of rays that end at it, and that went through.
RAY_WEIGHTS = (-1.41, -9.29, 3.94)

# Log-odds of rain for what ``surroundings_features`` says of its surroundings, in that order.
SURROUNDINGS_WEIGHTS = (-3.13, 7.13, 1.76, -1.27, -2.06, -0.31, -3.63, -0.79, -3.71, -1.97)

# Log-odds of rain in the simulated drives, which both witnesses count, and the sum only once.
PRIOR = -2.49


def surroundings_log_odds(points: ScanPoints) -> NDArray[np.float64]:
    """Log-odds of rain by each point's surroundings alone, float64 (M,)."""
    told: NDArray[np.float64] = surroundings_features(points) @ np.array(SURROUNDINGS_WEIGHTS)
    return told


def ray_log_odds(evidence: RayEvidence) -> NDArray[np.float64]:
    """Log-odds of rain by what other scans' rays say alone, float64 (M,)."""
    any_point, ending, through = RAY_WEIGHTS
    return any_point + ending * evidence.ending + through * evidence.through


def combined_log_odds(points: ScanPoints, evidence: RayEvidence | None) -> NDArray[np.float64]:
    """Log-odds of rain by all that is known of each point by itself, float64 (M,).

    Args:
        points: M points of a scan.
        evidence: What other scans' rays say; None where there is no other scan.
    """
    alone = surroundings_log_odds(points)
    return alone if evidence is None else alone + ray_log_odds(evidence) - PRIOR
