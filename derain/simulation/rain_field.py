"""Rain: its rate over the ground, the sizes of its drops, its extinction, and its record."""

import math
from dataclasses import dataclass
from functools import cached_property
from typing import Annotated

import numpy as np
from numpy.typing import ArrayLike

from derain.scan import Floats
from derain.simulation.settings import Settings, Within

# The facility's supply of water limits the product of rain rate and length of wet track, mm/h · m,
# and its sprinklers limit that length, metres: it rains 10, 25 and 50 mm/h over 112, 56 and 28 m.
# Source: REHEARSE-3D, section III.A.
WATER = 1400.0
LONGEST_SPAN = 112.0

# Share of the span, from the sensor on, that is evenly wet: 80 of 112 m.
# Source: REHEARSE-3D, section III.C.
EVEN_SHARE = 80 / 112

# Sprinklers stand in two rows along x, every SPACING metres, from FIRST_SPRINKLER, behind the
# sensor, to BEYOND_EVEN_PART metres beyond the evenly wet part. These and the constants that follow
# are modelling choices, made so that the field resembles Figure 4.
SPACING = 3.0
FIRST_SPRINKLER = -8.0
BEYOND_EVEN_PART = 4.0

# The water of each row comes down beside the axis, normally distributed across it. This is both the
# distance of the middle from the axis and the standard deviation, metres: when the two are equal,
# the sum of both rows is flattest on the axis.
THROW = 3.0

# Gusts of wind move the water in standing waves along the track, metres: along x towards the two
# peaks of Figure 4, and across the track to the right at the first peak and to the left at the
# second.
PEAKS = (25.0, 58.0)
GUST_ALONG = 1.15
GUST_ACROSS = 2.0

# Ratio of the mean rate on the axis to the nominal rate, which is the mean over the whole lane.
EXCESS_ON_AXIS = 1.13

# How long the mean wind carries a drop, seconds: drops of 1 to 2 mm fall 5 m at 5 m/s.
TIME_IN_WIND = 1.0

# The hardest rain on record fell at 1,900 mm/h, for a minute.
HARDEST_RAIN = 2000.0
RainRate = Annotated[float, Within(0, HARDEST_RAIN)]

# The greatest rate is looked for on a grid of this spacing, metres, and multiplied by a factor in
# case it is greater between the points of the grid.
SEARCH_STEP = 0.5
BETWEEN_STEPS = 1.01


@dataclass(frozen=True)
class UniformRain(Settings):
    """Rain that is the same everywhere.

    Attributes:
        nominal: Rain rate, mm/h; 0 is clear air.

    Raises:
        InputError: A rate below 0 or above HARDEST_RAIN.
    """

    SUBJECT = "rain"
    nominal: RainRate

    @property
    def heaviest(self) -> float:
        """A rate in mm/h that is exceeded nowhere: the only one."""
        return self.nominal

    def rate(self, x: Floats, y: Floats) -> Floats:
        """Rain rate in mm/h at ground positions, as of :meth:`SprinkledRain.rate`."""
        return np.full(np.shape(x), float(self.nominal))


@dataclass(frozen=True)
class SprinkledRain(Settings):
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

    SUBJECT = "rain"
    nominal: Annotated[float, lambda rate: 0 < rate <= HARDEST_RAIN]
    wind: Annotated[tuple[float, float], lambda wind: all(map(math.isfinite, wind))] = (0.0, 0.0)

    @property
    def span(self) -> float:
        """Length of the track that the sprinklers can wet, metres."""
        return min(LONGEST_SPAN, WATER / self.nominal)

    @cached_property
    def heaviest(self) -> float:
        """A rate in mm/h that is exceeded nowhere."""
        drift_x, drift_y = (TIME_IN_WIND * speed for speed in self.wind)
        x = np.arange(FIRST_SPRINKLER, self.span + BEYOND_EVEN_PART, SEARCH_STEP) + drift_x
        y = np.arange(-2 * THROW, 2 * THROW, SEARCH_STEP) + drift_y
        return BETWEEN_STEPS * float(self.rate(*np.meshgrid(x, y)).max())

    def rate(self, x: Floats, y: Floats) -> Floats:
        """Rain rate in mm/h at ground positions.

        Args:
            x: Forward, metres in the sensor frame, any shape.
            y: To the left, metres in the sensor frame, the same shape.
        """
        density = np.zeros(np.shape(x))
        for centre_x, centre_y in self._plumes():
            density += np.exp(-((x - centre_x) ** 2 + (y - centre_y) ** 2) / (2 * THROW**2))
        # The plumes have a height of 1 and stand so close that each row makes an even band. On the
        # axis, which is one standard deviation away from both bands, their heights add up to this.
        on_axis = 2 * math.exp(-0.5) * math.sqrt(2 * math.pi) * THROW / SPACING
        return EXCESS_ON_AXIS * self.nominal / on_axis * density

    def _plumes(self) -> Floats:
        """Places where the sprinklers' water comes down, float64 (P, 2), metres."""
        stand = np.arange(FIRST_SPRINKLER, EVEN_SHARE * self.span + BEYOND_EVEN_PART, SPACING)
        phase = 2 * np.pi * (stand - PEAKS[0]) / (PEAKS[1] - PEAKS[0])
        along = stand - GUST_ALONG * np.sin(phase)
        across = -GUST_ACROSS * np.cos(phase / 2)
        rows = [np.stack([along, across + side * THROW], axis=1) for side in (-1, 1)]
        return np.concatenate(rows) + TIME_IN_WIND * np.asarray(self.wind)


# A rain rate over the ground.
RainField = UniformRain | SprinkledRain


# Drop-size distribution N(D) = INTERCEPT · exp(−slope · D), in m⁻³ mm⁻¹.
# Source: Marshall and Palmer 1948, "The distribution of raindrops with size".
INTERCEPT = 8000.0

# A drop much larger than the wavelength takes twice its cross-section out of the beam.
# Source: the geometric limit of Mie scattering.
EXTINCTION_EFFICIENCY = 2.0


def slope(rate: ArrayLike) -> Floats:
    """Slope of the drop size distribution, Λ in mm⁻¹; infinite without rain.

    Source: Marshall and Palmer 1948, Λ = 4.1 R^−0.21.
    """
    with np.errstate(divide="ignore"):
        return np.asarray(4.1 * np.asarray(rate, np.float64) ** -0.21)


def extinction(rate: ArrayLike) -> Floats:
    """Share of the light that the rain takes out of a beam per metre, α in m⁻¹.

    π/4 · Q ∫ D² N(D) dD over all diameters, in closed form; 1e-6 turns mm² into m².

    Source: Kilic et al. 2021, "Lidar Light Scattering Augmentation (LISA)", for a constant
        extinction efficiency Q.
    """
    return 1e-6 * math.pi / 4 * EXTINCTION_EFFICIENCY * INTERCEPT * 2 / slope(rate) ** 3


# Optical depth at which a black object cannot be distinguished from the horizon: −ln 0.02.
# Source: Koschmieder 1924, with his contrast threshold of 2 %.
VISIBLE_OPTICAL_DEPTH = 3.912

# Half of the water of Marshall and Palmer's rain is in drops larger than this over Λ, the slope.
# Source: Ulbrich 1983, "Natural variations in the analytical form of the raindrop size
# distribution", for the exponential one.
MEDIAN_VOLUME_DIAMETER = 3.67


def weather_record(nominal: float, at_sensor: float, wind: tuple[float, float]) -> dict[str, float]:
    """The record of a weather station and a disdrometer in some rain.

    The drop spectrum N(D) = intercept · exp(−slope · D), the median diameter by volume and the
    visibility are those of the nominal rate. Clear air has an infinite slope, drops of no diameter,
    and no end to its visibility (``inf``). The wind's direction is where it blows to, from x
    (ahead) towards y (left).

    Args:
        nominal: Nominal rain rate, mm/h.
        at_sensor: Rain rate at the sensor's place, mm/h.
        wind: Velocity towards x (ahead) and y (left), m/s.

    Returns:
        Values by names, in which the units are.
    """
    steepness = float(slope(nominal))
    visibility = VISIBLE_OPTICAL_DEPTH / float(extinction(nominal)) if nominal else math.inf
    return {
        "rain_rate_mm_h": nominal,
        "rain_rate_at_sensor_mm_h": at_sensor,
        "drop_intercept_per_m3_mm": INTERCEPT,
        "drop_slope_per_mm": steepness,
        "median_volume_diameter_mm": MEDIAN_VOLUME_DIAMETER / steepness,
        "wind_speed_m_s": math.hypot(*wind),
        "wind_direction_deg": math.degrees(math.atan2(wind[1], wind[0])),
        "visibility_m": visibility,
    }
