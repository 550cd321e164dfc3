"""The road as a plane, where a scan shows one."""

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.scan import Bools, Floats
from derain.views.morton import evenly

# Distances between which the road is sought, metres: nearer lies the vehicle, farther off the road
# may not be flat.
NEAREST, FARTHEST = 1.5, 30.0

# No road climbs more to either side, as the sensor sees it, than its own tilt and a ramp.
STEEPEST_ROAD = 28.0

# Steps in degrees and in metres between the planes that are tried. They are fitted to points
# within so many metres, where a plane between two slopes is off by no more than a step of height.
STEP_OF_SLOPE, STEP_OF_HEIGHT, FARTHEST_ASKED = 2.0, 0.25, 15.0

# Points that low ones are sought among.
SAMPLE = 4096

# One point is taken of each square of this side, metres: near ground is seen in many more points
# than far ground. It is the one that so much of its square's points are below, so that neither
# what stands on the ground nor an echo from beneath it is taken.
SQUARE = 2.0
BELOW_IT = 0.2

# Fewer squares show no plane.
FEWEST_LOW_POINTS = 30

# Distances beyond which points have no weight, metres, from the first guess to the last: the rough
# plane is a quarter of a metre off, and curbs, snow and bumpers are above this last one.
SCALES = (0.5, 0.4, 0.3, 0.2, 0.2, 0.2, 0.2)

# Points this near to the plane are of the road, metres: its camber, its curbs and snow on it count.
IN_PLANE = 0.3

# Nearer than this to the road, no sensor is mounted, metres.
LOWEST_SENSOR = 0.3

# A plane that holds a smaller share of the points is none of the scene's.
LEAST_SHARE = 0.1


@dataclass(frozen=True)
class Ground:
    """A plane z = slope_x · x + slope_y · y + offset.

    Attributes:
        slope_x: Metres that it climbs per metre ahead.
        slope_y: Metres that it climbs per metre to the left.
        offset: Its height under the sensor, metres, below 0.
    """

    slope_x: float
    slope_y: float
    offset: float

    def is_above(self, xyz: NDArray[np.floating[Any]]) -> Bools:
        """True for points above the ground, bool (M,).

        Args:
            xyz: Coordinates, (M, 3), metres, sensor frame.
        """
        x, y, z = np.array(xyz.T, np.float64, order="C")
        return np.asarray(z - (self.slope_x * x + self.slope_y * y + self.offset) > IN_PLANE)


def find_ground(xyz: NDArray[np.floating[Any]]) -> Ground | None:
    """Finds the plane that most of the surface around the sensor lies in.

    Points are weighed by their distance, for near ground is seen in many more of them. Of planes of
    all slopes, and heights by steps, the one that holds the most is moved onto its points by
    weighted least squares (Tukey's biweight). Nothing is drawn at random.

    Args:
        xyz: Distinct positions along a Morton curve, (M, 3), metres, sensor frame.

    Returns:
        The plane; None where there is none below the sensor that holds a tenth of the points, and
        more than lie beneath it.
    """
    x, y, z = _low_points(xyz).T
    is_near = np.hypot(x, y) < FARTHEST_ASKED
    if np.count_nonzero(is_near) < FEWEST_LOW_POINTS:
        return None
    terms = np.column_stack([x, y, np.ones(len(x))])
    plane = _roughly(x[is_near], y[is_near], z[is_near])
    for scale in SCALES:
        ratio = (z - terms @ plane) / scale
        weighted = terms * np.square(np.maximum(1 - ratio * ratio, 0))[:, None]
        plane = np.linalg.lstsq(weighted.T @ terms, weighted.T @ z, rcond=None)[0]
    off = z - terms @ plane
    inside = np.abs(off) < IN_PLANE
    is_ground = inside.mean() > max(LEAST_SHARE, (off < -IN_PLANE).mean())
    slope_x, slope_y, offset = map(float, plane)
    flat_enough = math.hypot(slope_x, slope_y) < math.tan(math.radians(STEEPEST_ROAD))
    if not (is_ground and flat_enough and offset < -LOWEST_SENSOR):
        return None
    return Ground(slope_x, slope_y, offset)


def _low_points(xyz: NDArray[np.floating[Any]]) -> Floats:
    """A low point of each square around the sensor, float64 (S, 3)."""
    x, y, z = xyz.T
    squared = x * x + y * y
    around = (squared > NEAREST**2) & (squared < FARTHEST**2) & (np.abs(z) < FARTHEST)
    points = xyz[evenly(np.flatnonzero(around), SAMPLE)].astype(np.float64)
    column, line = np.floor(points[:, :2].T / SQUARE).astype(np.int64)
    square = column * int(4 * FARTHEST / SQUARE) + line
    order = np.lexsort((*points.T, square))
    _, start, count = np.unique(square[order], return_index=True, return_counts=True)
    return points[order[start + (BELOW_IT * count).astype(np.int64)]]


def _roughly(x: Floats, y: Floats, z: Floats) -> Floats:
    """Both slopes and the height, by steps, of the plane that holds most points, float64 (3,)."""
    slopes = np.tan(np.radians(np.arange(-STEEPEST_ROAD, STEEPEST_ROAD + 1, STEP_OF_SLOPE)))
    ahead, left = (slope.ravel() for slope in np.meshgrid(slopes, slopes))
    height = z - ahead[:, None] * x - left[:, None] * y
    step = np.floor(height / STEP_OF_HEIGHT).astype(np.int64)
    lowest = int(step.min())
    steps = int(step.max()) - lowest + 1
    numbers = step - lowest + steps * np.arange(len(ahead))[:, None]
    held = np.bincount(numbers.ravel(), minlength=steps * len(ahead)).reshape(len(ahead), steps)
    # Two steps together, so that a plane that lies across a boundary is not missed.
    held[:, :-1] += held[:, 1:]
    of_slopes, lower = np.unravel_index(int(held.argmax()), held.shape)
    offset = (int(lower) + lowest + 1) * STEP_OF_HEIGHT
    return np.array([ahead[of_slopes], left[of_slopes], offset])
