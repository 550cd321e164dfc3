"""What the rays of one scan say of the places where another scan has its points."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.recordings.known_points import ScanPoints, range_of

# How many of the other scan's rays are asked about each place. They lie on two or three of its
# beams, so that one drop more does not decide.
RAYS = 8

# A ray is asked about a place where it passes it by no more than this angle, degrees, or by so many
# steps of a coarser sensor. The wider, the more places have rays, and the more rays pass edges.
WITHIN, WITHIN_STEPS = 0.6, 1.8

# A ray that ends at the place: metres, and metres more for each metre of range, by which steps and
# registration make ends differ. One that ends farther behind it than the other bound went through.
ENDS_AT = (0.1, 0.01)
WENT_THROUGH = (0.5, 0.01)


# A ray that passes the place by this angle, degrees, counts half as much as one that meets it: of a
# sensor that stands the same ray comes back, and what it met tells more than all those around it.
# No nearer do rays of a sensor that moves pass: its poses are true to a tenth of a degree.
HALF_WEIGHT_AT = 0.1

# Where no ray passes near, what all of them say counts the less.
LEAST_WEIGHT = 0.2


@dataclass(frozen=True, eq=False)
class RayEvidence:
    """What the rays of another scan, or of several, say of the places of M points.

    Attributes:
        ending: Share of the rays near it that end at the place, float64 (M,), each counting the
            more the nearer it passes.
        through: Share of them that went through it to something behind, float64 (M,).
    """

    ending: NDArray[np.float64]
    through: NDArray[np.float64]


def ray_evidence(
    points: ScanPoints, other: ScanPoints, to_other: NDArray[np.float64]
) -> RayEvidence:
    """Asks the rays of another scan about the places of a scan's points.

    It does not matter how the sensor scans: its rays are where its returns are. Of a ray with two
    returns each is the end of a ray of its own: a solid one behind a drop went through its place.

    Args:
        points: The points, M of them.
        other: The other scan.
        to_other: Takes the frame of the points to that of the other scan, float64 (4, 4), metres.

    Returns:
        What they say; nothing where no ray is near.
    """
    if not len(other):
        return RayEvidence(np.zeros(len(points)), np.zeros(len(points)))
    places = points.xyz @ to_other[:3, :3].T + to_other[:3, 3]
    reach = range_of(places)
    rays, angles = other.rays_near(places / reach[:, None], RAYS)
    asked = angles <= max(np.radians(WITHIN), WITHIN_STEPS * points.step)
    behind = other.range.take(rays) - reach[:, None]
    at, through = (offset + slope * reach[:, None] for offset, slope in (ENDS_AT, WENT_THROUGH))
    weight = asked / (1 + np.square(angles / np.radians(HALF_WEIGHT_AT)))
    total_weight = np.maximum(weight.sum(axis=1), LEAST_WEIGHT)
    return RayEvidence(
        (weight * (np.abs(behind) <= at)).sum(axis=1) / total_weight,
        (weight * (behind > through)).sum(axis=1) / total_weight,
    )


def mean_evidence(evidence: list[RayEvidence]) -> RayEvidence:
    """What several scans say together, each as much as the others.

    Args:
        evidence: What each says, at least one.
    """
    return RayEvidence(
        np.mean([one.ending for one in evidence], axis=0),
        np.mean([one.through for one in evidence], axis=0),
    )
