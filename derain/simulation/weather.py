"""The weather in which a scan is taken, and the record of it."""

import math
from dataclasses import dataclass
from typing import Self

from numpy.random import Generator

from derain.simulation.marshall_palmer import INTERCEPT, extinction, slope

# Optical depth at which a black object cannot be told from the horizon: −ln 0.02.
# Source: Koschmieder 1924, with his contrast threshold of 2 %.
VISIBLE_OPTICAL_DEPTH = 3.912

# Half of the water of Marshall and Palmer's rain is in drops larger than this over Λ, the slope.
# Source: Ulbrich 1983, "Natural variations in the analytical form of the raindrop size
# distribution", for the exponential one.
MEDIAN_VOLUME_DIAMETER = 3.67

# Strongest mean wind along each axis, m/s, a modelling choice: a light breeze, for in more the
# facility's rain would not come down on its track.
STRONGEST_WIND = 2.0


def draw_wind(generator: Generator) -> tuple[float, float]:
    """Draws a wind: its velocity towards x (ahead) and y (left), m/s."""
    ahead, left = generator.uniform(-STRONGEST_WIND, STRONGEST_WIND, 2)
    return float(ahead), float(left)


@dataclass(frozen=True)
class Weather:
    """What a weather station and a disdrometer would measure; units are in the names.

    The drop spectrum N(D) = intercept · exp(−slope · D), the median diameter by volume and the
    visibility are those of the nominal rate. Clear air has an infinite slope, drops of no diameter,
    and no end to its visibility (``inf``). The wind's direction is where it blows to, from x
    (ahead) towards y (left).
    """

    rain_rate_mm_h: float
    rain_rate_at_sensor_mm_h: float
    drop_intercept_per_m3_mm: float
    drop_slope_per_mm: float
    median_volume_diameter_mm: float
    wind_speed_m_s: float
    wind_direction_deg: float
    visibility_m: float

    @classmethod
    def of(cls, nominal: float, at_sensor: float, wind: tuple[float, float]) -> Self:
        """The record of some rain.

        Args:
            nominal: Rain rate asked for, mm/h.
            at_sensor: Rain rate at the sensor's place, mm/h.
            wind: Velocity towards x (ahead) and y (left), m/s.
        """
        steepness = float(slope(nominal))
        return cls(
            rain_rate_mm_h=nominal,
            rain_rate_at_sensor_mm_h=at_sensor,
            drop_intercept_per_m3_mm=INTERCEPT,
            drop_slope_per_mm=steepness,
            median_volume_diameter_mm=MEDIAN_VOLUME_DIAMETER / steepness,
            wind_speed_m_s=math.hypot(*wind),
            wind_direction_deg=math.degrees(math.atan2(wind[1], wind[0])),
            visibility_m=VISIBLE_OPTICAL_DEPTH / float(extinction(nominal))
            if nominal
            else math.inf,
        )
