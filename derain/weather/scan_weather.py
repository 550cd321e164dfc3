"""The weather that a scan shows: where its rays meet rain."""

from collections.abc import Iterable
from dataclasses import dataclass
from functools import cached_property
from typing import Self

import numpy as np

from derain.errors import InputError
from derain.scan import Array, Bools, Floats, Ints, Scan
from derain.weather.rays import BIN, RANGE_BINS, RAY_SECTORS, ray_ends
from derain.weather.visibility import NOT_KNOWN, Visibility, reach_of, visibility_of

# Where the bands of range begin, metres: each is twice as deep as the one before, for the farther,
# the less rain is seen. The last one has no end.
RANGE_BANDS = (0, 5, 10, 20, 40, 80)

# Reach is the range within which this share of the rays end. The farthest hundredth is bounded by
# the sensor and the air more than by the walls around it.
SHARE_REACHED = 0.99

# Dry scans reach as far as all but this share of them do.
SHARE_OF_DRY_BELOW = 0.05


@dataclass(frozen=True, eq=False)
class ScanWeather:
    """Numbers of rays of a scan, or of several, by where they end and at what.

    Example:
        >>> points = np.fromfile("scan.bin", np.float32).reshape(-1, 4)  # x, y, z, intensity
        >>> weather = ScanWeather.of(points, derain.FilterDerainer(derain.DROR())(points))
        >>> weather.rays, weather.met_rain, str(weather.visibility)
        (820, 20, '42.9 m [29.5 to 64.7 m]')

    Attributes:
        ends: int64 (2, RAY_SECTORS, RANGE_BINS): rays that end at something else, and rays that
            end at rain; by sector of azimuth and by bin of range (:mod:`derain.weather.rays`).
    """

    ends: Ints

    @classmethod
    def of(cls, points: Scan | Array, rain: Bools) -> Self:
        """The weather of a judged scan.

        Args:
            points: A Scan, or (N, ≥ 3) numbers: x, y, z in metres, in the frame of the sensor.
            rain: Its rain by labels or by any method, bool (N,).

        Raises:
            InputError: Points of another shape, or not one answer for each.
        """
        scan, rain = Scan.of(points), np.asarray(rain)
        if rain.shape != (len(scan),) or rain.dtype != np.bool_:
            reason = f"it is {rain.dtype} of shape {rain.shape} for {len(scan):,} points"
            raise InputError("rain", reason, "Give True or False for each point.")
        return cls(ray_ends(scan, rain))

    @classmethod
    def none(cls) -> Self:
        """That of no scan, to which others can be added."""
        return cls(np.zeros((2, RAY_SECTORS, RANGE_BINS), np.int64))

    def __add__(self, other: "ScanWeather") -> "ScanWeather":
        """Both together, as if of one scan."""
        return ScanWeather(self.ends + other.ends)

    @property
    def rays(self) -> int:
        """Number of rays that came back."""
        return int(self.ends.sum())

    @property
    def met_rain(self) -> int:
        """Number of them that met rain."""
        return int(self.ends[1].sum())

    @cached_property  # by sector, by range and together, what is shown is made of it
    def banded(self) -> Ints:
        """The same numbers by bands of range, int64 (2, RAY_SECTORS, len(RANGE_BANDS))."""
        first_bins = [int(band / BIN) for band in RANGE_BANDS]
        return np.add.reduceat(self.ends, first_bins, axis=2)

    @property
    def shares(self) -> Floats:
        """Share of rain in the rays that end in a sector and band.

        It is float64 (RAY_SECTORS, len(RANGE_BANDS)).

        NaN where none does: what is there is not known.
        """
        return _shares(self.banded)

    @property
    def shares_by_sector(self) -> Floats:
        """Share of the rays of each sector that met rain.

        It is float64 (RAY_SECTORS,); NaN without any.
        """
        return _shares(self.ends.sum(axis=2))

    @property
    def shares_by_range(self) -> Floats:
        """Share of rain in the rays that end in each band.

        It is float64 (len(RANGE_BANDS),); NaN likewise.
        """
        return _shares(self.banded.sum(axis=1))

    @cached_property
    def visibility(self) -> Visibility:
        """The range that 90 % of the rays get through without meeting rain."""
        return visibility_of(*self.ends.sum(axis=1))

    @cached_property
    def reach(self) -> Visibility:
        """The range within which 99 % of the rays end, at rain or anything else."""
        return self.range_of(SHARE_REACHED)

    def range_of(self, share: float) -> Visibility:
        """The range within which a share of the rays end, at rain or anything else.

        Args:
            share: Of the rays, such as 0.95.
        """
        return reach_of(self.ends.sum(axis=(0, 1)), share)

    def visibility_in(self, *sectors: int) -> Visibility:
        """That of some sectors alone, such as of what is ahead.

        Args:
            sectors: Their numbers: 0 is ahead, 3 left, 6 behind, 9 right.

        Raises:
            InputError: No sector has such a number.
        """
        odd = [number for number in sectors if not 0 <= number < RAY_SECTORS]
        if odd or not sectors:
            remedy = f"Give numbers from 0 to {RAY_SECTORS - 1}."
            raise InputError("sectors", f"{odd or 'none'}", remedy)
        return visibility_of(*self.ends[:, list(sectors)].sum(axis=1))


def dry_reach(dry: Iterable[ScanWeather]) -> Visibility:
    """The reach that nineteen of twenty dry scans of a sensor have at least.

    It is that of one of them: of the scans sorted by their reach, the one after a twentieth of
    them. Not known where none of them has 100 rays.

    Args:
        dry: Weather of each dry scan.
    """
    known = sorted((one.reach for one in dry if one.reach.known), key=lambda reach: reach.at_least)
    return known[int(SHARE_OF_DRY_BELOW * len(known))] if known else NOT_KNOWN


def _shares(ends: Ints) -> Floats:
    """Share of rain in numbers (2, ...), float64 (...); NaN where there are none."""
    total = ends.sum(axis=0)
    shares: Floats = np.full(total.shape, np.nan)
    np.divide(ends[1], total, out=shares, where=total > 0)
    return shares
