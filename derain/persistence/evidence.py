"""What speaks for rain at each point: other scans' rays, and its surroundings in its own scan.

Both are weighed as witnesses who do not know of each other: log-odds of each alone, added. Their
weights are fitted to simulated drives (``benchmarks/persistence_weights.py``), whose truth is
known; no label of a real scan had a part in it, and neither has intensity.
"""

import numpy as np
from numpy.typing import NDArray

from derain.persistence.points import ScanPoints
from derain.persistence.rays import RayEvidence
from derain.persistence.surroundings import describe

# Log-odds of rain: of any point; for each share of rays that end at it, and that went through.
OF_RAYS = (-1.67, -12.45, 4.51)

# Log-odds of rain for what ``describe`` says of its surroundings, in that order.
OF_SURROUNDINGS = (-4.05, 7.64, 1.5, -3.77, -2.23, -0.29, -4.53, -0.6, -3.26, -1.91)

# Log-odds of rain in the simulated drives, which both witnesses count, and the sum only once.
PRIOR = -2.42


def of_surroundings(points: ScanPoints) -> NDArray[np.float64]:
    """Log-odds of rain by each point's surroundings alone, float64 (M,)."""
    told: NDArray[np.float64] = describe(points) @ np.array(OF_SURROUNDINGS)
    return told


def of_rays(evidence: RayEvidence) -> NDArray[np.float64]:
    """Log-odds of rain by what other scans' rays say alone, float64 (M,)."""
    any_point, ending, through = OF_RAYS
    return any_point + ending * evidence.ending + through * evidence.through


def together(points: ScanPoints, evidence: RayEvidence | None) -> NDArray[np.float64]:
    """Log-odds of rain by all that is known of each point by itself, float64 (M,).

    Args:
        points: M points of a scan.
        evidence: What other scans' rays say; None where there is no other scan.
    """
    alone = of_surroundings(points)
    return alone if evidence is None else alone + of_rays(evidence) - PRIOR
