"""The light that rain lets through, along beams in uneven rain."""

import math

import numpy as np
from numpy.typing import NDArray

from derain.simulation.marshall_palmer import extinction
from derain.simulation.rain_field import RainField

# The field is sampled in so many sectors around the sensor, and along each of them every so many
# metres.
SECTORS = 360
SAMPLE_SPACING = 1.0


class Transmission:
    """The share of the light that survives the way to a distance and back, seen from the sensor.

    The extinction is integrated over the ground by the trapezoidal rule, once for each sector of a
    degree. Beyond the last sample the mean extinction is taken to stay what it is up to there.

    Args:
        rain: The rain.
        maximum_range: How far the field is sampled, metres.
    """

    def __init__(self, rain: RainField, maximum_range: float) -> None:
        distance = SAMPLE_SPACING * np.arange(math.ceil(maximum_range / SAMPLE_SPACING) + 1)
        azimuth = 2 * np.pi * np.arange(SECTORS) / SECTORS
        direction = np.stack([np.cos(azimuth), np.sin(azimuth)])[:, :, None]
        x, y = direction * distance
        local = extinction(rain.rate(x, y))
        depth = np.cumsum((local[:, :-1] + local[:, 1:]) * SAMPLE_SPACING / 2, axis=1)
        # Mean extinction from the sensor to each sample, float64 (SECTORS, samples), m⁻¹. Unlike
        # the integral over the ground it holds for beams of every inclination, and interpolating
        # between samples is exact where the rain is the same everywhere.
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
        steps = np.minimum(range * np.hypot(x, y) / SAMPLE_SPACING, last)
        before = np.minimum(steps.astype(np.int64), last - 1)
        share = steps - before
        mean = (1 - share) * self._mean[sector, before] + share * self._mean[sector, before + 1]
        return np.asarray(np.exp(-2 * mean * range))
