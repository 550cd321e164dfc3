"""Visibility, by the rain that rays meet, and reach, by the range at which they end."""

import math
from dataclasses import dataclass

import numpy as np

from derain.scan import Ints
from derain.weather.rays import BIN

# Visibility is the range that this share of the rays gets through.
SHARE_THROUGH = 0.9

# Rain is counted up to here, metres. A sensor sees drops only where they return enough light: the
# largest ones, by the packaged sensors of `derain simulate`, as far as 5 to 31 m. Farther on rain
# goes on to stop rays, but nothing comes back of it.
LOOK = 10.0

# Fewer rays are no scan.
FEWEST_RAYS = 100

# Ends of an interval: the truth lies beyond each with a chance of one in twenty, by this quantile
# of the normal distribution.
ONE_IN_TWENTY = 1.645

# An interval is printed where its far end is more than this many times its near one.
WIDE = 1.5

# What is farther is as good as clear air, metres: of a hundred thousand rays, a hundred meet rain.
CLEAR_AIR = 1000.0


@dataclass(frozen=True)
class Visibility:
    """A range that the rays of a scan show, with its interval of 90 % confidence.

    Attributes:
        metres: The estimate; None where the range is farther than the scan can show, and where
            nothing is known.
        at_least: Near end of the interval, metres; 0 where nothing is known.
        at_most: Far end, metres; infinite where it is farther than the scan can show.
    """

    metres: float | None
    at_least: float
    at_most: float

    @property
    def known(self) -> bool:
        """True if the scan has enough rays for an interval."""
        return self.at_least > 0 or self.at_most < math.inf

    @property
    def shown(self) -> float:
        """The estimate, or else the near end, metres."""
        return self.at_least if self.metres is None else self.metres

    def shorter_of(self, other: "Visibility") -> "Visibility":
        """The shorter of two ranges, end by end; where one is not known, only its far end is."""
        metres = [each.metres for each in (self, other) if each.metres is not None]
        return Visibility(
            min(metres, default=None),
            min(self.at_least, other.at_least),
            min(self.at_most, other.at_most),
        )

    def __str__(self) -> str:
        if not self.known:
            return "not known"
        if self.metres is None:
            return f"over {_text(self.shown)} m"
        if self.at_most <= WIDE * self.at_least:
            return f"{_text(self.metres)} m"
        end = f"to {_text(self.at_most)} m" if self.at_most < math.inf else "m or more"
        return f"{_text(self.metres)} m [{_text(self.at_least)} {end}]"


NOT_KNOWN = Visibility(None, 0.0, math.inf)


def visibility_of(other: Ints, rain: Ints) -> Visibility:
    """The range that 90 % of the rays would get through if it rained alike everywhere.

    The rate at which rays meet rain is their number over the metres that all rays go, in the first
    10 m. A ray that ends at something else counts as far as it goes. Drops at ranges that few rays
    reach are thus few drops beside many metres, and a scan of few metres has a wide interval.

    Args:
        other: Numbers of rays that end at something else, by bin of range, int64 (B,).
        rain: Numbers of rays that end at rain, by bin of range, int64 (B,).

    Returns:
        The range; not known for fewer than 100 rays.

    Sources: the law of Bouguer, Lambert and Beer, by which the share of rays that get through
        falls exponentially; the rate of an exponential law from censored lives is deaths over time
        at risk (Cox and Oakes 1984, "Analysis of Survival Data", 3.2).
    """
    ending = other + rain
    if ending.sum() < FEWEST_RAYS:
        return NOT_KNOWN
    bins = int(LOOK / BIN)
    coming = ending[::-1].cumsum()[::-1]
    metres_gone = BIN * float((coming - ending / 2)[:bins].sum())
    drops = int(rain[:bins].sum())
    least, most = poisson_interval(drops)
    near, metres, far = (
        -math.log(SHARE_THROUGH) * metres_gone / count if count else math.inf
        for count in (most, drops, least)
    )
    return Visibility(
        metres if metres <= CLEAR_AIR else None,
        min(near, CLEAR_AIR),
        far if far <= CLEAR_AIR else math.inf,
    )


def reach_of(ending: Ints, share: float) -> Visibility:
    """The range within which a share of the rays end.

    Args:
        ending: Numbers of rays that end in each bin of range, int64 (B,); the last bin has no end.
        share: Of the rays, such as 0.99.

    Returns:
        The range; not known for fewer than 100 rays, and at least 300 m beyond the bins.

    Source: Conover 1999, "Practical Nonparametric Statistics", 3.2: the interval of a quantile lies
        between the quantiles at its share plus and minus the spread of that share.
    """
    rays = int(ending.sum())
    if rays < FEWEST_RAYS:
        return NOT_KNOWN
    spread = ONE_IN_TWENTY * math.sqrt(share * (1 - share) / rays)
    near, metres, far = (_within(ending, each) for each in (share - spread, share, share + spread))
    last = BIN * (len(ending) - 1)  # where the last bin begins
    return Visibility(metres if metres < math.inf else None, min(near, last), far)


def poisson_interval(count: int) -> tuple[float, float]:
    """The means between which that of a Poisson count lies, with a chance of 90 %.

    Source: the approximation of Byar, in Breslow and Day 1987, "Statistical Methods in Cancer
        Research" 2, 2.3.
    """

    def end(number: int, quantile: float) -> float:
        return number * max(1 - 1 / (9 * number) + quantile / (3 * math.sqrt(number)), 0.0) ** 3

    return end(count, -ONE_IN_TWENTY) if count else 0.0, end(count + 1, ONE_IN_TWENTY)


def _within(ending: Ints, share: float) -> float:
    """Metres within which a share of the rays end; infinite beyond the bins and for all rays."""
    ended = ending.cumsum()
    wanted = share * int(ended[-1])
    if share >= 1 or wanted > ended[-2]:
        return math.inf
    place = int(np.searchsorted(ended, wanted))
    before = int(ended[place] - ending[place])
    return BIN * (place + (wanted - before) / int(ending[place]))


def _text(metres: float) -> str:
    return f"{metres:,.{1 if metres < 100 else 0}f}"
