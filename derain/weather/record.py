"""The weather of one scan in figures: how a recording is printed, and written as a table."""

import math
from dataclasses import dataclass, fields
from typing import Self

import numpy as np

from derain.scan import Floats
from derain.weather.alarm import Level
from derain.weather.rays import RAY_SECTORS
from derain.weather.scan_weather import RANGE_BANDS, ScanWeather
from derain.weather.visibility import Visibility

# Digits of shares: rays are a hundred thousand at most.
SHARE_DIGITS = 5


@dataclass(frozen=True)
class WeatherRecord:
    """The weather of one scan; None stands for an unknown value.

    Attributes:
        rays: Its rays.
        met_rain: Those of them that met rain.
        visibility_m: The range that 90 % of them would get through, metres; None where it is
            farther than the scan can show.
        visibility_from_m: Near end of its interval, metres.
        visibility_to_m: Far end of its interval, metres; None where there is none.
        reach_95_m: The range within which 95 % of the rays end, metres.
        reach_99_m: The range within which 99 % end, metres.
        reach_of_dry: ``reach_99_m`` over that of the dry reference; None without one.
        level: clear, warning or error, by this scan alone; None where it leaves that open.
        alarm: clear, warning or error, by the scans of its recording so far; None of a scan that
            is of no recording.
        shares: Share of rain in the rays that end in each sector of 30 degrees (the first ahead,
            then towards the left) and from 0, 5, 10, 20, 40 and 80 m on.
    """

    rays: int
    met_rain: int
    visibility_m: float | None
    visibility_from_m: float | None
    visibility_to_m: float | None
    reach_95_m: float | None
    reach_99_m: float | None
    reach_of_dry: float | None
    level: str | None
    alarm: str | None
    shares: list[list[float | None]]

    def __str__(self) -> str:
        near, far = self.visibility_from_m or 0.0, self.visibility_to_m or math.inf
        level = self.level or "level open"
        alarm = "" if self.alarm in (None, self.level) else f", alarm {self.alarm}"
        reach = "" if self.reach_99_m is None else f", reach {self.reach_99_m:.0f} m"
        return f"visibility {Visibility(self.visibility_m, near, far)}{reach} ({level}{alarm})"

    @classmethod
    def of(
        cls, weather: ScanWeather, dry: Visibility | None, level: Level | None, alarm: Level | None
    ) -> Self:
        """The weather of a scan, its level and the alarm after it, beside a dry reference."""
        seen, reach = weather.visibility, weather.reach
        of_dry = None
        if dry is not None and dry.metres and reach.metres is not None:
            of_dry = round(reach.metres / dry.metres, SHARE_DIGITS)
        return cls(
            rays=weather.rays,
            met_rain=weather.met_rain,
            visibility_m=_rounded(seen.metres),
            visibility_from_m=_rounded(seen.at_least) if seen.known else None,
            visibility_to_m=_rounded(seen.at_most),
            reach_95_m=_rounded(weather.range_of(0.95).metres),
            reach_99_m=_rounded(reach.metres),
            reach_of_dry=of_dry,
            level=None if level is None else str(level),
            alarm=None if alarm is None else str(alarm),
            shares=[_known(row) for row in weather.shares],
        )


# The columns of a table: the figures of a scan, then the shares by sector and by range.
FIGURES = [field.name for field in fields(WeatherRecord) if field.name != "shares"]
SECTOR_TITLES = [f"share_at_{360 // RAY_SECTORS * sector}_deg" for sector in range(RAY_SECTORS)]
BAND_TITLES = [f"share_from_{band}_m" for band in RANGE_BANDS]
WEATHER_COLUMNS = [*FIGURES, *SECTOR_TITLES, *BAND_TITLES]


def weather_row(record: WeatherRecord, weather: ScanWeather) -> list[object]:
    """The row of a table, in the order of WEATHER_COLUMNS."""
    figures = [getattr(record, name) for name in FIGURES]
    return [*figures, *_known(weather.shares_by_sector), *_known(weather.shares_by_range)]


def _rounded(metres: float | None) -> float | None:
    return None if metres is None or math.isinf(metres) else round(metres, 2)


def _known(shares: Floats) -> list[float | None]:
    """Shares of one row, None where they are not known."""
    return [None if np.isnan(share) else round(float(share), SHARE_DIGITS) for share in shares]
