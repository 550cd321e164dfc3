"""Candidates: bounds outside which no point is rain, so that none is searched there."""

from collections.abc import Iterable, Sequence
from dataclasses import asdict, dataclass
from typing import Any

import numpy as np

from derain.files.documents import Entry
from derain.scan import Bools, Float32s, Scan
from derain.views.channels import MOST_CHANNELS

# Bounds are compared as float32, as which a larger number would be infinite.
LARGEST_FLOAT32 = float(np.finfo(np.float32).max)


@dataclass(frozen=True)
class Bound:
    """Bounds of one channel: the least and the greatest value of rain.

    Attributes:
        channel: Its name, as :meth:`Scan.channel` takes it.
        least: Smallest value of rain, in the channel's unit; None without such a bound.
        most: Largest value of rain.
    """

    channel: str
    least: float | None = None
    most: float | None = None

    def holds(self, values: Float32s) -> Bools:
        """True for values within the bound, bool (N,); also True for unknown values, NaN."""
        outside = np.zeros(len(values), bool)
        # Nothing is less or greater than NaN. A bound as float32 compares as fast as can be.
        if self.least is not None:
            outside |= values < np.float32(self.least)
        if self.most is not None:
            outside |= values > np.float32(self.most)
        return ~outside

    def __str__(self) -> str:
        match self.least, self.most:
            case least, None:
                return f"{self.channel} of at least {least:g}"
            case None, most:
                return f"{self.channel} of at most {most:g}"
            case least, most:
                return f"{self.channel} from {least:g} to {most:g}"


@dataclass(frozen=True)
class Candidates:
    """Points that may be rain: those within all bounds. All other points are not rain.

    Attributes:
        bounds: The bounds, one per channel.
        points: Share of candidates among the points that the bounds were fitted to.
        rain: Share of candidates among the rain of these points.
        rain_share: Share of rain among the candidates of these points.
    """

    bounds: tuple[Bound, ...]
    points: float = 1.0
    rain: float = 1.0
    rain_share: float = 0.0

    def among(self, scan: Scan) -> Bools:
        """True for rows of a scan that are candidates.

        A missing channel or value excludes no point.

        Args:
            scan: The scan, its intensities in the unit of the data that the bounds were fitted to.

        Returns:
            bool (N,); undefined for rows that cannot be judged.
        """
        candidate = np.ones(len(scan), bool)
        for bound in self.bounds:
            values = scan.channel(bound.channel)
            if values is not None:
                candidate &= bound.holds(values)
        return candidate

    def as_dict(self) -> dict[str, Any]:
        """The candidates as JSON-able primitives, which :func:`candidates_at` reads back."""
        return {**asdict(self), "bounds": [asdict(bound) for bound in self.bounds]}

    def __str__(self) -> str:
        bounds = ", ".join(map(str, self.bounds))
        return f"{bounds}: {self.points:.1%} of the points, {self.rain:.2%} of the rain"


def narrower(some: Iterable[Bound], others: Iterable[Bound]) -> tuple[Bound, ...]:
    """The intersection of both bounds, one bound per channel."""
    by_channel = {bound.channel: bound for bound in some}
    for other in others:
        bound = by_channel.get(other.channel, other)
        least = [limit for limit in (bound.least, other.least) if limit is not None]
        most = [limit for limit in (bound.most, other.most) if limit is not None]
        both = Bound(other.channel, max(least, default=None), min(most, default=None))
        by_channel[other.channel] = both
    return tuple(by_channel.values())


def candidates_at(entry: Entry) -> Candidates | None:
    """Reads candidates from an untrusted document; None if it has none.

    Raises:
        InputError: Something that does not describe them.
    """
    if entry.value is None:
        return None
    shares = dict.fromkeys(("points", "rain", "rain_share"), lambda entry: entry.within(0, 1))
    return Candidates(**entry.record({"bounds": _bounds, **shares}, required=("bounds",)))


def bounded_channels(channels: Sequence[str]) -> tuple[str, ...]:
    """Channels that may bound a network's candidates: range, height, and its other inputs.

    x and y are left out: they only show where the training scans had rain. Channels that the
    network does not see, such as the intensity of an unknown sensor, are left out too.

    Args:
        channels: Input channels of the network.
    """
    return ("range", "z", *(name for name in channels if name not in ("range", "x", "y", "z")))


def _bounds(entry: Entry) -> tuple[Bound, ...]:
    bounds = tuple(_bound(item) for item in entry.items()[: MOST_CHANNELS + 1])
    channels = [bound.channel for bound in bounds]
    if len(set(channels)) < len(channels) or not 0 < len(channels) <= MOST_CHANNELS:
        raise entry.fault("it bounds no channel, or one twice", "Write one bound per channel.")
    return bounds


def _bound(entry: Entry) -> Bound:
    parsers = {"channel": Entry.text, "least": _number_or_none, "most": _number_or_none}
    bound = Bound(**entry.record(parsers, required=("channel",)))
    if bound.least is None is bound.most:
        raise entry.fault("it has neither least nor most", "Write one of them.")
    if bound.least is not None and bound.most is not None and bound.least > bound.most:
        raise entry.fault("its least is more than its most", "Write the smaller one as least.")
    return bound


def _number_or_none(entry: Entry) -> float | None:
    return None if entry.value is None else entry.within(-LARGEST_FLOAT32, LARGEST_FLOAT32)
