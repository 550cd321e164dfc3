"""Fits candidates to scans with known rain."""

import math
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from derain.errors import InputError
from derain.scan import Bools, Float32s, Scan
from derain.views.candidates import Bound, Candidates, bounded_channels
from derain.views.channels import channel_values
from derain.views.morton import first_rows

# Default share of the rain that candidates hold.
RAIN_INSIDE = 0.999
LEAST_INSIDE = 0.5

# A bound has to leave out at least this share of the points; others are not worth a comparison.
WORTH = 0.05

# The tail of the rain is read from the ten outermost points: of fewer it has none.
FEWEST = 10

# Bounds are rounded outwards to this many digits, so that they can be read.
DIGITS = 3


def fit_candidates(
    scans: Iterable[tuple[Scan, Bools]], channels: Sequence[str], inside: float = RAIN_INSIDE
) -> Candidates | None:
    """Finds bounds that hold a stated share of the rain with a margin, and leave out what they can.

    Each side of each channel is allowed an equal part of the rain that may be left out, and the
    bound found so is moved outwards by a margin from the rain's own tail: as far again as
    from ten times that part to the part itself. Of a tail that falls exponentially, a tenth of the
    part is left out then, in scans alike. Where the part is less than one point of the rain, the
    bound starts from the outermost one, and the tail behind the ten outermost is followed further
    for each power of ten. Sides that leave out hardly a point are not bounded.

    Args:
        scans: Scans, and for each which of its rows are rain, bool (N,).
        channels: Input channels of the network; see :func:`bounded_channels`.
        inside: Share of the rain that is to be within all bounds, from 0.5 to below 1.

    Returns:
        The candidates; None where there is no rain or too little, or where it is as the rest is.

    Raises:
        InputError: Another share.
    """
    if not LEAST_INSIDE <= inside < 1:
        remedy = f"Give one from {LEAST_INSIDE:g} to below 1, such as {RAIN_INSIDE:g}."
        raise InputError("candidates", f"{inside:g} is no share of the rain", remedy)
    names = bounded_channels(channels)
    values, rain = _gathered(scans, names)
    if not rain.any():
        return None
    outside = 1 - inside
    every = [
        _Side(name, is_most, of_channel if is_most else -of_channel, rain)
        for name, of_channel in zip(names, values, strict=True)
        for is_most in (False, True)
    ]
    sides = [side for side in every if side.leaves_out(side.limit(outside)).mean() >= WORTH]
    limits = {side: side.limit(outside / len(sides)) for side in sides}
    candidate = np.ones(len(rain), bool)
    for side, limit in limits.items():
        candidate &= ~side.leaves_out(limit)
    if candidate.mean() > 1 - WORTH:
        return None
    return Candidates(
        _bounds(limits),
        points=float(candidate.mean()),
        rain=float(candidate[rain].mean()),
        rain_share=float(rain[candidate].mean()),
    )


@dataclass(frozen=True, eq=False)
class _Side:
    """One side of a channel, seen so that rain is what lies low.

    Attributes:
        channel: Name of the channel.
        is_most: True if it is that of large values.
        values: Those of all points, of the other side with their sign changed, float32 (M,); NaN
            where a point has none.
        rain: True for points of rain, bool (M,).
    """

    channel: str
    is_most: bool
    values: Float32s
    rain: Bools

    def limit(self, outside: float) -> float:
        """The limit above which nothing is rain; infinite if too little rain has a value.

        Args:
            outside: Share of the rain that may be above it, were there no margin.
        """
        rain = self.values[self.rain]
        rain = rain[~np.isnan(rain)]
        if len(rain) < FEWEST:
            return math.inf
        tail = max(outside, 1 / len(rain))
        shares = [max(1 - 10 * tail, 0.5), 1 - tail]
        before, edge = np.quantile(rain, shares, method="higher").astype(float)
        return _rounded_up(edge + (edge - before) * (1 + math.log10(tail / outside)))

    def leaves_out(self, limit: float) -> Bools:
        """True for points above a limit, bool (M,)."""
        return self.values > np.float32(limit)


def _gathered(
    scans: Iterable[tuple[Scan, Bools]], channels: Sequence[str]
) -> tuple[Float32s, Bools]:
    """Values of all distinct positions, float32 (C, M), and which are rain, bool (M,)."""
    values, rain = [np.zeros((len(channels), 0), np.float32)], [np.zeros(0, bool)]
    for scan, is_rain in scans:
        rows = first_rows(scan)
        values.append(channel_values(scan, rows, channels))
        rain.append(is_rain[rows])
    return np.concatenate(values, axis=1), np.concatenate(rain)


def _bounds(limits: Mapping[_Side, float]) -> tuple[Bound, ...]:
    """The limits as bounds, one for each channel that has any."""
    by_channel: dict[str, dict[str, float]] = {}
    for side, limit in limits.items():
        bound = {"most": limit} if side.is_most else {"least": -limit}
        by_channel.setdefault(side.channel, {}).update(bound)
    return tuple(Bound(channel, **bound) for channel, bound in by_channel.items())


def _rounded_up(number: float) -> float:
    """The least number of that many digits that is not less."""
    if not number:
        return 0.0
    digits = DIGITS - 1 - math.floor(math.log10(abs(number)))
    return round(math.ceil(number * 10.0**digits) / 10.0**digits, max(digits, 0))
