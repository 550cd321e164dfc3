"""How hard it rains where: evenly, or as under the sprinklers of a rain facility."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError

# The facility's water, in mm/h times metres of wet track, and the length that its sprinklers can
# wet: 10, 25 and 50 mm/h over 112, 56 and 28 m.
# Source: REHEARSE-3D, section III.A.
WATER = 1400.0
LONGEST_SPAN = 112.0

# Share of the span, from the sensor on, that is evenly wet: 80 of 112 m.
# Source: REHEARSE-3D, section III.C.
EVEN_SHARE = 80 / 112

# Sprinklers stand in two rows along x, this far apart, from behind the sensor to a little beyond
# the evenly wet part, metres. What follows are modelling choices that come to Figure 4.
SPACING = 3.0
FIRST_SPRINKLER = -8.0
MARGIN = 4.0

# Where a row's water comes down: Gaussian about a line beside the axis. Distance and standard
# deviation being the same, the two rows together are flattest in the middle. Metres.
THROW = 3.0

# The wind blows in gusts, standing waves along the track: it carries water along x towards the two
# peaks of Figure 4, and across the track to the one's right and the other's left, metres.
PEAKS = (25.0, 58.0)
GUST_ALONG = 1.15
GUST_ACROSS = 2.0

# Excess of the mean rate on the axis over the nominal one, which is the mean of the whole lane.
EXCESS_ON_AXIS = 1.13

# How long water is in the wind, seconds: the way down from 5 m at the 5 m/s of drops of 1 to 2 mm.
TIME_IN_WIND = 1.0

# The hardest rain on record fell at 1,900 mm/h, for a minute.
HARDEST_RAIN = 2000.0

# Step in metres at which the greatest rate is looked for, and what may lie between the steps.
STEP = 0.5
BETWEEN_STEPS = 1.01


class RainField(Protocol):
    """A rain rate over the ground."""

    @property
    def heaviest(self) -> float:
        """A rate in mm/h that is exceeded nowhere."""

    def rate(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rain rate in mm/h at ground positions.

        Args:
            x: Forward, metres in the sensor frame, any shape.
            y: To the left, metres in the sensor frame, the same shape.
        """


@dataclass(frozen=True)
class UniformRain:
    """Rain that is the same everywhere.

    Attributes:
        nominal: Rain rate, mm/h; 0 is clear air.

    Raises:
        InputError: A rate below 0 or above HARDEST_RAIN.
    """

    nominal: float

    def __post_init__(self) -> None:
        if not 0 <= self.nominal <= HARDEST_RAIN:
            raise _no_rate(self.nominal)

    @property
    def heaviest(self) -> float:
        """The rain rate, in mm/h."""
        return self.nominal

    def rate(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """The rain rate in mm/h, for each position."""
        return np.full(np.shape(x), float(self.nominal))


@dataclass(frozen=True)
class SprinkledRain:
    """Rain from two rows of sprinklers along x, as in the facility of REHEARSE-3D.

    Within 3 m of the axis it is 0.8 to 1.4 times the nominal rate up to 80 m at 10 mm/h, 40 m at
    25 mm/h and 20 m at 50 mm/h, and less than a fifth of it 8 m farther on. Ahead of the sensor it
    is heaviest near (25, -2) and (58, 2) m, as far as the sprinklers reach.

    Attributes:
        nominal: Nominal rain rate, mm/h.
        wind: Velocity of the mean wind towards x and y, m/s. It carries the whole field along.

    Raises:
        InputError: A rate that is not above 0 or above HARDEST_RAIN, or a wind that is not finite.

    Source: REHEARSE-3D, Figure 4.
    """

    nominal: float
    wind: tuple[float, float] = (0.0, 0.0)

    def __post_init__(self) -> None:
        if not 0 < self.nominal <= HARDEST_RAIN:
            raise _no_rate(self.nominal)
        if not all(map(math.isfinite, self.wind)):
            raise InputError("wind", f"{self.wind} m/s is no wind", "Give two finite numbers.")

    @property
    def span(self) -> float:
        """Length of the track that the sprinklers can wet, metres."""
        return min(LONGEST_SPAN, WATER / self.nominal)

    @cached_property
    def heaviest(self) -> float:
        """A rate in mm/h that is exceeded nowhere."""
        x = np.arange(FIRST_SPRINKLER, self.span + MARGIN, STEP) + TIME_IN_WIND * self.wind[0]
        y = np.arange(-2 * THROW, 2 * THROW, STEP) + TIME_IN_WIND * self.wind[1]
        return BETWEEN_STEPS * float(self.rate(*np.meshgrid(x, y)).max())

    def rate(self, x: NDArray[np.float64], y: NDArray[np.float64]) -> NDArray[np.float64]:
        """Rain rate in mm/h at ground positions.

        Args:
            x: Forward, metres in the sensor frame, any shape.
            y: To the left, metres in the sensor frame, the same shape.
        """
        density = np.zeros(np.shape(x))
        for centre_x, centre_y in self._plumes():
            density += np.exp(-((x - centre_x) ** 2 + (y - centre_y) ** 2) / (2 * THROW**2))
        # Plumes of unit height, so close that they make an even band: its height on the axis is
        # that of a row, once for each row, at the distance of one standard deviation.
        on_axis = 2 * math.exp(-0.5) * math.sqrt(2 * math.pi) * THROW / SPACING
        return EXCESS_ON_AXIS * self.nominal / on_axis * density

    def _plumes(self) -> NDArray[np.float64]:
        """Where the sprinklers' water comes down, float64 (P, 2), metres."""
        stand = np.arange(FIRST_SPRINKLER, EVEN_SHARE * self.span + MARGIN, SPACING)
        phase = 2 * np.pi * (stand - PEAKS[0]) / (PEAKS[1] - PEAKS[0])
        along = stand - GUST_ALONG * np.sin(phase)
        across = -GUST_ACROSS * np.cos(phase / 2)
        rows = [np.stack([along, across + side * THROW], axis=1) for side in (-1, 1)]
        return np.concatenate(rows) + TIME_IN_WIND * np.asarray(self.wind)


def _no_rate(rate: float) -> InputError:
    return InputError(
        "rain rate", f"{rate} mm/h is no rain rate", f"Give up to {HARDEST_RAIN:g} mm/h."
    )
