"""Input channels: the values of a point that a network sees, by name.

A channel is ``x``, ``y``, ``z``, ``range``, ``intensity``, ``radar``, or any other column of the
scan's file, such as ``doppler`` or ``rcs``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import replace

import numpy as np

from derain.scan import Float32s, Ints, Scan

# The default channels of networks. All other channels are extra: a scan need not have them, and a
# data card has their statistics only after a network has used them.
USUAL_CHANNELS = ("x", "y", "z", "intensity", "range")

# Far more than any sensor measures of a point.
MOST_CHANNELS = 64

# Names of input channels in their order, and replacements of values that a scan lacks, by channel.
Channels = tuple[str, ...]
FillValues = Mapping[str, float]

UNITS = {
    **dict.fromkeys(("x", "y", "z", "range"), "m"),
    "doppler": "m/s",
    "rcs": "dBsm",
    "radar": "0 or 1",
}


def extra_channels(channels: Sequence[str]) -> tuple[str, ...]:
    """Those of some channels that are not usual, in their order."""
    return tuple(name for name in channels if name not in USUAL_CHANNELS)


def with_columns(scan: Scan, channels: Sequence[str]) -> Scan:
    """The same scan with nothing in `fields` but some channels, float32, where it has them."""
    columns = {name: scan.channel(name) for name in channels}
    present = {name: column for name, column in columns.items() if column is not None}
    return replace(scan, fields=present)


def channel_values(scan: Scan, rows: Ints, channels: Sequence[str]) -> Float32s:
    """Values of a channel at some points of a scan.

    Args:
        scan: The scan.
        rows: Row numbers of points that are valid, int64 (M,).
        channels: Names of C channels.

    Returns:
        float32 (C, M), each channel in its own unit; NaN for values that the scan lacks.
    """
    return np.stack([_column(scan, name)[rows] for name in channels])


def filled_values(
    scan: Scan, rows: Ints, channels: Sequence[str], fill_value: FillValues
) -> Float32s:
    """Values of channels at some points of a scan, with replacements for missing ones.

    Args:
        scan: The scan.
        rows: Row numbers of points that are valid, int64 (M,).
        channels: Names of C channels.
        fill_value: Replacement of a missing value, by channel; 0 if not named.

    Returns:
        float32 (M, C), each channel in its own unit; finite where the stand-ins are.
    """
    return np.ascontiguousarray(channel_image(scan, rows, channels, fill_value).T)


def channel_image(
    scan: Scan, winner: Ints, channels: Sequence[str], fill_value: FillValues
) -> Float32s:
    """Values of channels in the pixels of an image, with replacements for missing ones.

    Args:
        scan: The scan.
        winner: Row of the point in each pixel, one that is valid, int64 (M,); -1 in empty pixels.
        channels: Names of C channels.
        fill_value: Replacement of a missing value, by channel; 0 if not named.

    Returns:
        float32 (C, M), finite; 0 in empty pixels.
    """
    image = np.empty((len(channels), len(winner)), np.float32)
    for of_channel, name in zip(image, channels, strict=True):
        # The last value is what row -1 has, so that no pass over the empty pixels is needed.
        of_channel[:] = np.append(_column(scan, name), np.float32(0))[winner]
        of_channel[np.isnan(of_channel)] = fill_value.get(name, 0.0)
    return image


def _column(scan: Scan, name: str) -> Float32s:
    """A channel of all rows, float32 (N,); NaN where the scan lacks it."""
    column = scan.channel(name)
    return np.full(len(scan), np.nan, np.float32) if column is None else column
