"""Neighbourhoods in steps of the sensor's beams: nothing that differs between sensors."""

import torch
from torch import Tensor
from torch.nn import functional

from derain.models.layers.steps import (
    FARTHEST_IN_STEPS,
    NEAREST_POINT,
    NEAREST_TO_AXIS,
    STEP_EPSILON,
    USUAL_RANGE,
    asinh,
    farther_by,
)

# A step is the angle to the third nearest beam among those of a point's neighbours. Two of the
# nearest lie on either side, along the axis of finer resolution, and another return of the point's
# own beam may be nearer still.
STEP_NEIGHBOUR = 3

# The step of a scan is the median over so many of its points, evenly spread over its rows. With
# 2,049, the answers changed with the order of the rows: one scan of snow, turned by half a degree,
# went from an IoU of .54 to .67.
SAMPLED_POINTS = 32769

# Radians; no sensor's beams lie closer together.
FINEST_ANGLE = 1e-4

# Added to what is divided by, which may be 0.
EPSILON = 1e-3


def in_steps(points: Tensor, distances: Tensor, neighbours: Tensor) -> tuple[Tensor, Tensor]:
    """Where each point's neighbours are, along its beam and across it.

    A step is the angle between neighbouring beams, the angular resolution of the sensor. It is
    taken from the scan itself: the median over its points of the angle to the third nearest among
    their neighbours' beams. In metres it is that angle times the range of the point.

    Args:
        points: x, y, z in metres, in the sensor's frame, float (M, 3).
        distances: Distances to the neighbours, metres, float (M, k).
        neighbours: The point itself, then its neighbours, as rows of ``points``, int64 (M, k).

    Returns:
        Of each neighbour but the point itself, in steps: the logarithm of its distance; and as
        inverse hyperbolic sines how much farther it is from the sensor, how far aside it is, on
        whichever side, and how far up; float (M, k - 1, 4). And the logarithms of the points'
        ranges over 10 m, float (M,).
    """
    own = functional.embedding(neighbours[:, 0], points)
    x, y, z = own.unbind(1)
    level = (x * x + y * y).sqrt().clamp_min(NEAREST_TO_AXIS)
    distance = (x * x + y * y + z * z).sqrt().clamp_min(NEAREST_POINT)
    offset = functional.embedding(neighbours[:, 1:], points) - own[:, None]
    ahead, left, up = offset.unbind(2)
    level_dot = x[:, None] * ahead + y[:, None] * left
    outwards = level_dot / level[:, None]
    aside = (x[:, None] * left - y[:, None] * ahead) / level[:, None]
    risen = (level[:, None] * up - z[:, None] * outwards) / distance[:, None]
    farther = farther_by(distance[:, None], level_dot + z[:, None] * up, distances[:, 1:])
    step = _step(aside, risen, distance)
    length = (distance * step)[:, None]
    seen = torch.stack(
        [
            torch.log(distances[:, 1:] / length + STEP_EPSILON),
            asinh(farther / length),
            asinh(aside.abs() / length),
            asinh(risen / length),
        ],
        dim=2,
    )
    return seen.clamp(-FARTHEST_IN_STEPS, FARTHEST_IN_STEPS), torch.log(distance / USUAL_RANGE)


def _step(aside: Tensor, risen: Tensor, distance: Tensor) -> Tensor:
    """The angle between neighbouring beams, radians, float (); of no points 0.1."""
    angles = (aside.square() + risen.square()).sqrt() / distance[:, None]
    # A row more, so that there is one to take the median of.
    angles = torch.cat([angles, angles.new_full((1, angles.shape[1]), 0.1)])
    some = torch.arange(SAMPLED_POINTS, device=angles.device) * distance.shape[0] // SAMPLED_POINTS
    third = angles[some].topk(STEP_NEIGHBOUR, dim=1, largest=False).values[:, -1]
    return third.topk(SAMPLED_POINTS // 2 + 1).values[-1].clamp_min(FINEST_ANGLE)
