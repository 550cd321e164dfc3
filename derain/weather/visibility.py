"""How far the rays of a scan get through rain."""

import math
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.weather.rays import BIN

# Visibility is the range that this share of the rays gets through.
SHARE_THROUGH = 0.9

# How far rays are followed, metres. A sensor sees drops only where they return enough light: the
# largest ones, by the packaged sensors of `derain simulate`, as far as 5 to 31 m. Farther on rain
# goes on to stop rays, but nothing comes back of it.
LOOK = 10.0

# Rays are followed no farther than so many of them go.
FEWEST_RAYS = 100

# Where no more is seen than by chance might be missed of so many drops, with one chance in twenty:
# e⁻³ is .05. Source: Hanley and Lippman-Hand 1983, the rule of three.
MISSED_BY_CHANCE = 3.0

# What is farther is as good as clear air, metres: of a hundred thousand rays, a hundred meet rain.
CLEAR_AIR = 1000.0


@dataclass(frozen=True)
class Visibility:
    """The range that 90 % of the rays would get through if it rained alike everywhere.

    That is, if rays met rain everywhere as often as they do in the first 10 m, of which the scan
    shows it: a sensor sees little rain farther off, though it goes on to stop rays.

    Attributes:
        metres: The range; None where it is farther than a scan can tell, and where nothing is
            known.
        at_least: What it is at least, metres: itself; or how far a scan of so many rays can tell,
            1,000 m at most; 0 where nothing is known.
        looked: How far the rays were followed, metres: 10, or less where fewer than 100 rays go as
            far; 0 where nothing is known.
        through: Share of the rays that get as far as that without meeting rain.
    """

    metres: float | None
    at_least: float
    looked: float
    through: float

    @property
    def known(self) -> bool:
        """Whether the scan has enough rays to say anything."""
        return self.looked > 0

    def __str__(self) -> str:
        if not self.known:
            return "not known"
        metres = f"{self.at_least:,.{1 if self.at_least < 100 else 0}f} m"
        return f"over {metres}" if self.metres is None else metres


def transmission(other: NDArray[np.int64], rain: NDArray[np.int64]) -> NDArray[np.float64]:
    """Share of the rays that would get so far without meeting rain, if nothing else ended them.

    A ray that ends at something else says nothing of what is behind it: it is censored there. So
    this is the life table of survival analysis, of which rain is the death: in each bin the share
    of the rays that meet rain, of those that come there, where one that ends in the bin otherwise
    counts half.

    Args:
        other: Numbers of rays that end at something else, by bin of range, int64 (B,).
        rain: Numbers of rays that end at rain, by bin of range, int64 (B,).

    Returns:
        At the beginning of each bin, and at the end of the last one, float64 (B + 1,); 1 at the
        sensor, falling.

    Source: Cutler and Ederer 1958, "Maximum utilization of the life table method in analyzing
        survival"; with bins of no width it is the estimate of Kaplan and Meier 1958.
    """
    exposed = _coming(other + rain) - other / 2
    met = np.divide(rain, exposed, out=np.zeros(len(rain)), where=rain > 0)
    return np.concatenate([[1.0], np.cumprod(1 - met)])


def visibility_of(other: NDArray[np.int64], rain: NDArray[np.int64]) -> Visibility:
    """The visibility that numbers of rays tell.

    Args:
        other: Numbers of rays that end at something else, by bin of range, int64 (B,).
        rain: Numbers of rays that end at rain, by bin of range, int64 (B,).
    """
    coming = _coming(other + rain)
    followed = min(int((coming >= FEWEST_RAYS).sum()), int(LOOK / BIN))
    looked = followed * BIN
    if followed == 0:
        return Visibility(None, 0.0, 0.0, 1.0)
    through = float(transmission(other, rain)[followed])
    metres = _range_at(looked, through)
    can_tell = min(CLEAR_AIR, _range_at(looked, 1 - MISSED_BY_CHANCE / int(coming[0])))
    if metres > can_tell:
        return Visibility(None, can_tell, looked, through)
    return Visibility(metres, metres, looked, through)


def _range_at(looked: float, through: float) -> float:
    """The visibility, metres, where a share of the rays gets through the metres looked at.

    Source: the law of Bouguer, Lambert and Beer, by which the share falls exponentially.
    """
    if through <= 0:
        return 0.0
    return looked * math.log(SHARE_THROUGH) / math.log(through) if through < 1 else math.inf


def _coming(ending: NDArray[np.int64]) -> NDArray[np.int64]:
    """How many rays come to each bin, int64 (B,), from how many end in each."""
    return ending[::-1].cumsum()[::-1]
