"""The light that rain lets through, along beams in uneven rain."""

import math

import numpy as np
from numpy.typing import NDArray

from derain.simulation.marshall_palmer import extinction
from derain.simulation.rain_field import RainField

# The field is sampled in as many sectors around the sensor, and in steps of as many metres.
SECTORS = 360
STEP = 1.0


class Transmission:
    """The share of the light that survives the way to a distance and back, seen from the sensor.

    The extinction is integrated over the ground by the trapezoidal rule, once for each sector of a
    degree; beyond the last step it is as on the way there.

    Args:
        rain: The rain.
        maximum_range: How far the field is sampled, metres.
    """

    def __init__(self, rain: RainField, maximum_range: float) -> None:
        distance = STEP * np.arange(math.ceil(maximum_range / STEP) + 1)
        azimuth = 2 * np.pi * np.arange(SECTORS) / SECTORS
        direction = np.stack([np.cos(azimuth), np.sin(azimuth)])[:, :, None]
        x, y = direction * distance
        local = extinction(rain.rate(x, y))
        depth = np.cumsum((local[:, :-1] + local[:, 1:]) * STEP / 2, axis=1)
        # The mean on the way to each step, float64 (SECTORS, steps), m⁻¹. Unlike its integral it
        # serves beams of every inclination, and is exact in even rain.
        self._mean = np.concatenate([local[:, :1], depth / distance[1:]], axis=1)

    def __call__(
        self, beams: NDArray[np.float64], range: NDArray[np.float64]
    ) -> NDArray[np.float64]:
        """Share of the light that survives the way there and back, float64 (N,).

        Args:
            beams: Unit vectors, float64 (N, 3), sensor frame.
            range: Distances along them, float64 (N,), metres.
        """
        x, y, _ = beams.T
        turn = np.arctan2(y, x) / (2 * np.pi)
        sector = np.rint(turn * SECTORS).astype(np.int64) % SECTORS
        last = self._mean.shape[1] - 1
        steps = np.minimum(range * np.hypot(x, y) / STEP, last)
        before = np.minimum(steps.astype(np.int64), last - 1)
        share = steps - before
        mean = (1 - share) * self._mean[sector, before] + share * self._mean[sector, before + 1]
        return np.asarray(np.exp(-2 * mean * range))
