"""Shared parts of networks with neighbours in steps of the sensor's beams, and shells of range."""

import torch
from torch import Tensor
from torch.nn import functional

# Nothing is measured nearer than this, metres, nor right above the sensor; both keep every
# division finite.
NEAREST_POINT = 0.05
NEAREST_TO_AXIS = 0.01

# Added to what logarithms are taken of, which may be 0.
STEP_EPSILON = 1e-2

# Ranges are logarithms over this one, metres.
USUAL_RANGE = 10.0

# However far a neighbour is, no number that describes it is greater.
FARTHEST_IN_STEPS = 10.0

# How many numbers describe where a neighbour is.
NEIGHBOUR_NUMBERS = 4

# Slope of every activation below 0.
NEGATIVE_SLOPE = 0.1

# Shells around the sensor in which what a scan holds is averaged: logarithms of their ranges over
# 10 m, which are 1.7 to 90 m, and how far each reaches into the next.
SHELLS = (-1.8, 2.2, 9)
SHELL_REACH = 0.35


def active(features: Tensor) -> Tensor:
    """Features after their activation."""
    return functional.leaky_relu(features, NEGATIVE_SLOPE)


def asinh(steps: Tensor) -> Tensor:
    """The inverse hyperbolic sine, by a logarithm: onnxruntime's own is many times slower."""
    size = steps.abs()
    return torch.sign(steps) * torch.log(size + (size * size + 1).sqrt())


def farther_by(distance: Tensor, dot: Tensor, apart: Tensor) -> Tensor:
    """Difference of ranges between neighbours: a difference of squares by the sum.

    The difference of two ranges would leave the rounding of both, which where beams lie close is no
    small part of a step.

    Args:
        distance: Ranges of the points, metres, float; of a shape that goes with the others'.
        dot: Products of the points with the offsets of their neighbours, float.
        apart: Their distances from the points, metres, float.

    Returns:
        Metres, float, in the shape of ``dot``.
    """
    squares = 2 * dot + apart * apart
    return squares / ((distance * distance + squares).clamp_min(0).sqrt() + distance)


def both_logits(rain: Tensor) -> Tensor:
    """Logits of "not rain", which are 0, and of "rain", float (M, 2), of the latter, float (M,)."""
    return torch.stack([torch.zeros_like(rain), rain], dim=1)
