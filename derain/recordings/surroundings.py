"""How a point's surroundings look in its own scan: a drop has nothing near it, and no surface."""

import numpy as np
from numpy.typing import NDArray

from derain.recordings.known_points import ScanPoints
from derain.views.scatter import scatter_through_space

# What is added before a logarithm is taken, and what is then 0 in the middle of what scans hold.
STEP_EPSILON, USUAL_STEPS = 1e-3, 1.0
FLATTEST, USUAL_SCATTER, SPREAD_OF_SCATTER = 1e-4, -4.5, 2.0
USUAL_RANGE = 10.0

# Radians; a scan whose rays are said to lie closer has too few to say.
LEAST_STEP = 1e-5


def surroundings_features(points: ScanPoints) -> NDArray[np.float64]:
    """Three numbers for each point, and their squares and products.

    The numbers are logarithms: of the mean distance of a point's neighbours in steps of the
    sensor's rays at its range; of the smallest eigenvalue of their covariance over the sum of all
    three, which is 0 on a surface; and of its range. None of them differs between sensors.

    Args:
        points: M points of a scan.

    Returns:
        One, the numbers, and their six squares and products, float64 (M, 10), finite.
    """
    step = max(points.step, LEAST_STEP)
    steps_apart = points.distances[:, 1:].mean(axis=1) / (points.range * step)
    scatter = scatter_through_space(points.xyz, points.neighbours)
    apart = np.log(steps_apart + STEP_EPSILON) - USUAL_STEPS
    rough = (np.log(scatter + FLATTEST) - USUAL_SCATTER) / SPREAD_OF_SCATTER
    far = np.log(points.range / USUAL_RANGE)
    return np.stack(
        [
            *(np.ones_like(apart), apart, rough, far),
            *(apart**2, rough**2, far**2, apart * rough, apart * far, rough * far),
        ],
        axis=1,
    )
