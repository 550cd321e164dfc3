"""Input channels: the values of a point that a network sees, by name.

A channel is ``x``, ``y``, ``z``, ``range``, ``intensity``, ``radar``, any other column of the
scan's file, such as ``doppler`` or ``rcs``, or ``dual_return``, which is made of the scan: 1 at the
nearer of two returns of a ray, -1 at the farther, 0 at the only one. Drops are rarest at -1, and
most frequent at 1.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan
from derain.views.returns import pair_returns

# The channel of the place of a return in its ray.
DUAL_RETURN = "dual_return"

# The channel of the rank of a point's intensity among those of its scan, in so many steps: what
# stays the same whatever unit and gain a sensor's intensities have.
INTENSITY_RANK = "intensity_rank"
INTENSITY_RANKS = 32

# What networks see unless they are told otherwise. All other channels are extra: a scan need not
# have them, and a data card has their statistics only where a network has asked for them.
USUAL_CHANNELS = ("x", "y", "z", "intensity", "range")

# Far more than any sensor measures of a point.
MOST_CHANNELS = 64

UNITS = {
    **dict.fromkeys(("x", "y", "z", "range"), "m"),
    "doppler": "m/s",
    "rcs": "dBsm",
    "radar": "0 or 1",
    DUAL_RETURN: "-1, 0 or 1",
    INTENSITY_RANK: "0 to 1",
}


def extra_channels(channels: Sequence[str]) -> tuple[str, ...]:
    """Those of some channels that are not usual, in their order."""
    return tuple(name for name in channels if name not in USUAL_CHANNELS)


def channel_of(scan: Scan, name: str) -> NDArray[np.float32] | None:
    """One value per point, by name.

    Args:
        scan: The scan.
        name: As :meth:`Scan.channel` knows it, or ``dual_return``.

    Returns:
        float32 (N,), in the channel's own unit; NaN where a value is missing. None where the scan
        has no such channel: no ``dual_return`` where nothing shows that any ray has two returns,
        for a sensor that tells one is another than one that has seen none behind it.
    """
    column = scan.channel(name)
    if column is not None or name not in (DUAL_RETURN, INTENSITY_RANK):
        return column
    if name == INTENSITY_RANK:
        return _intensity_rank(scan)
    returns = pair_returns(scan)
    if not returns.dual:
        return None
    # In the middle of three, the ray went through as well.
    return np.where(returns.nearer, 1, np.where(returns.farther, -1, 0)).astype(np.float32)


def _intensity_rank(scan: Scan) -> NDArray[np.float32] | None:
    """How bright points are among those of their scan, from 0 to 1 in steps, float32 (N,).

    Every intensity that occurs counts by the root of how often it does: where most of the points
    share one, such as 0, the others are still told apart.
    """
    intensity = scan.measured_intensity
    if intensity is None:
        return None
    levels, points = np.unique(intensity[scan.valid], return_counts=True)
    darker = np.append(0, np.cumsum(np.sqrt(points)))  # than each level, and than none
    steps = np.arange(1, INTENSITY_RANKS) / INTENSITY_RANKS * darker[-1]
    first_level = np.searchsorted(darker[:-1], steps)
    edges = np.append(levels, np.float32(np.inf))[first_level]
    rank = np.searchsorted(edges, intensity, side="right")
    return (rank / np.float32(INTENSITY_RANKS - 1)).astype(np.float32)


def with_columns(scan: Scan, channels: Sequence[str]) -> Scan:
    """The same scan with nothing in `fields` but some channels, float32, where it has them.

    Ranks of intensity are left out: they are of the points that a scan has when it is viewed, of
    which training may drop some before.
    """
    columns = {name: channel_of(scan, name) for name in channels if name != INTENSITY_RANK}
    present = {name: column for name, column in columns.items() if column is not None}
    return replace(scan, fields=present)


def channel_values(
    scan: Scan, rows: NDArray[np.int64], channels: Sequence[str]
) -> NDArray[np.float32]:
    """What some points of a scan measure.

    Args:
        scan: The scan.
        rows: Row numbers of points that are valid, int64 (M,).
        channels: Names of C channels.

    Returns:
        float32 (C, M), each channel in its own unit; NaN for values that the scan lacks.
    """
    values = np.full((len(channels), len(rows)), np.nan, np.float32)
    for of_channel, name in zip(values, channels, strict=True):
        column = channel_of(scan, name)
        if column is not None:
            of_channel[:] = column[rows]
    return values


def filled_values(
    scan: Scan,
    rows: NDArray[np.int64],
    channels: Sequence[str],
    fill_value: Mapping[str, float],
) -> NDArray[np.float32]:
    """What some points of a scan measure, point by point, and a stand-in for what they lack.

    Args:
        scan: The scan.
        rows: Row numbers of points that are valid, int64 (M,).
        channels: Names of C channels.
        fill_value: What stands in for a value that is missing, by channel; 0 if not named.

    Returns:
        float32 (M, C), each channel in its own unit; finite where the stand-ins are.
    """
    of_all = np.empty((len(scan), len(channels)), np.float32)
    for number, name in enumerate(channels):
        column = channel_of(scan, name)
        of_all[:, number] = np.nan if column is None else column
    # All of a point at once: four times faster than channel by channel.
    values = of_all.take(rows, axis=0)
    for of_channel, name in zip(values.T, channels, strict=True):
        of_channel[np.isnan(of_channel)] = fill_value.get(name, 0.0)
    return values


def channel_image(
    scan: Scan,
    winner: NDArray[np.int64],
    channels: Sequence[str],
    fill_value: Mapping[str, float],
) -> NDArray[np.float32]:
    """What the points in the pixels of an image measure, and a stand-in for what they lack.

    Args:
        scan: The scan.
        winner: Row of the point in each pixel, one that is valid, int64 (M,); -1 in empty pixels.
        channels: Names of C channels.
        fill_value: What stands in for a value that is missing, by channel; 0 if not named.

    Returns:
        float32 (C, M), finite; 0 in empty pixels.
    """
    image = np.empty((len(channels), len(winner)), np.float32)
    for of_channel, name in zip(image, channels, strict=True):
        column = channel_of(scan, name)
        if column is None:
            column = np.full(len(scan), np.nan, np.float32)
        # The last value is what row -1 has, so that no pass over the empty pixels is needed.
        of_channel[:] = np.append(column, np.float32(0))[winner]
        of_channel[np.isnan(of_channel)] = fill_value.get(name, 0.0)
    return image
