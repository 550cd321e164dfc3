"""Lowers answers right before the sensor: the vehicle or mast that carries it."""

import math

import torch
from torch import Tensor

from derain.models.cues.geometry import USUAL_RANGE

# The vehicle or mast that carries a sensor is seen within OF_CARRIER metres, often in a few
# scattered points that look like drops. Real drops do not end there: from there to BEYOND_CARRIER
# metres the sensor sees as many again or, where rain is dense, drops that make up SHARE_OF_CARRIER
# of the scan. Modelling choices.
OF_CARRIER, BEYOND_CARRIER = 2.0, 6.0
SHARE_OF_CARRIER = 0.0025

# Where fewer lie beyond than would be expected, near logits are lowered, in proportion to how many
# are missing: by CERTAINLY_NOT once a third more would be expected than there are. HALF_A_DROP is
# added to those beyond, since there may be none to divide by.
CERTAINLY_NOT, OF_A_THIRD = 20.0, 3.0
HALF_A_DROP = 0.5


def without_carrier(rain: Tensor, far: Tensor, size: Tensor) -> Tensor:
    """Lowers logits of rain right before the sensor where there is hardly any rain beyond.

    It is a rule for scans as they are judged, and is not learnt.

    Args:
        rain: Logits of rain of M points of a scan, float (M,).
        far: Logarithms of their ranges over 10 m, float (M,).
        size: Number of all points of the scan, also of those that are not judged, float64 ().

    Returns:
        Logits, float (M,).
    """
    near = far < math.log(OF_CARRIER / USUAL_RANGE)
    beyond = ~near & (far < math.log(BEYOND_CARRIER / USUAL_RANGE))
    # Sums of many points in float64: in float32 they differ from one runtime to another.
    drops = rain.sigmoid().double()
    expected = torch.minimum((drops * near).sum(), SHARE_OF_CARRIER * size)
    missing = expected / ((drops * beyond).sum() + HALF_A_DROP) - 1
    taken_back = CERTAINLY_NOT * (OF_A_THIRD * missing).clamp(0, 1).to(rain.dtype)
    return rain - taken_back * near
