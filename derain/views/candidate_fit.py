"""Fits candidates to scans with known rain."""

import math
from collections.abc import Iterable, Mapping, Sequence

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

# Signs of values in which those of rain lie low, by the side that is bounded.
SIGNS = {"least": -1, "most": 1}

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
    # Each side of each channel, seen so that rain is what lies low.
    sides = {
        (name, end): sign * of_channel
        for name, of_channel in zip(names, values, strict=True)
        for end, sign in SIGNS.items()
    }
    beyond = {side: _above(_limit(low[rain], outside), low).mean() for side, low in sides.items()}
    sides = {side: low for side, low in sides.items() if beyond[side] >= WORTH}
    limits = {side: _limit(low[rain], outside / len(sides)) for side, low in sides.items()}
    candidate = np.ones(len(rain), bool)
    for side, limit in limits.items():
        candidate &= ~_above(limit, sides[side])
    if candidate.mean() > 1 - WORTH:
        return None
    return Candidates(
        _bounds(limits),
        points=float(candidate.mean()),
        rain=float(candidate[rain].mean()),
        rain_share=float(rain[candidate].mean()),
    )


def _limit(rain: Float32s, outside: float) -> float:
    """The limit above which nothing is rain; infinite if too little rain has a value.

    Args:
        rain: Values of points of rain, float32 (R,); NaN where a point has none.
        outside: Share of the rain that may be above it, were there no margin.
    """
    rain = rain[~np.isnan(rain)]
    if len(rain) < FEWEST:
        return math.inf
    tail = max(outside, 1 / len(rain))
    shares = [max(1 - 10 * tail, 0.5), 1 - tail]
    before, edge = np.quantile(rain, shares, method="higher").astype(float)
    return _rounded_up(edge + (edge - before) * (1 + math.log10(tail / outside)))


def _above(limit: float, values: Float32s) -> Bools:
    """True for values, float32 (M,), above a limit, bool (M,)."""
    return values > np.float32(limit)


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


def _bounds(limits: Mapping[tuple[str, str], float]) -> tuple[Bound, ...]:
    """The limits, by channel and side, as bounds, one for each channel that has any."""
    by_channel: dict[str, dict[str, float]] = {}
    for (channel, end), limit in limits.items():
        by_channel.setdefault(channel, {})[end] = SIGNS[end] * limit
    return tuple(Bound(channel, **ends) for channel, ends in by_channel.items())


def _rounded_up(number: float) -> float:
    """The least number of that many digits that is not less."""
    if not number:
        return 0.0
    digits = DIGITS - 1 - math.floor(math.log10(abs(number)))
    return round(math.ceil(number * 10.0**digits) / 10.0**digits, max(digits, 0))
