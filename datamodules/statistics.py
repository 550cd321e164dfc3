"""Statistics of training scans, by which a network's input is normalised."""

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import CHANNELS_OF_STATISTICS, DataCard
from derain.errors import InputError
from derain.scan import Scan
from derain.views.channels import USUAL_CHANNELS, channel_values

# A variance below this share of the squared mean is what rounding leaves of a constant.
ROUNDING = 1e-12


def with_statistics(card: DataCard, scans: Iterable[Scan], extra: Sequence[str] = ()) -> DataCard:
    """Completes a data card with the statistics that it lacks.

    Mean and standard deviation of x, y, z and range in metres, of intensity and of extra channels,
    over the valid points of all scans; 0 and 1 for a channel without values. The share of rain is
    that among the points of known class; it is not measured where a scan has no labels.

    Args:
        card: A data card.
        scans: Training scans.
        extra: Names of further channels.

    Raises:
        InputError: An extra channel without any value.
    """
    channels = (*USUAL_CHANNELS, *extra)
    count, total, squares = np.zeros((3, len(channels)))
    rain, judged, labelled = 0, 0, True
    for scan in scans:
        rows = np.flatnonzero(scan.valid)
        values = channel_values(scan, rows, channels).astype(np.float64)
        count += (~np.isnan(values)).sum(axis=1)
        total += np.nansum(values, axis=1)
        squares += np.nansum(values**2, axis=1)
        labelled = labelled and scan.label is not None
        if labelled:
            rain += int(card.rain_of(scan)[rows].sum())
            judged += int((~card.unknown_of(scan)[rows]).sum())
    _refuse_missing(extra, count[len(USUAL_CHANNELS) :])
    mean = total / np.maximum(count, 1)
    variance = squares / np.maximum(count, 1) - mean**2
    # A constant channel is not divided by 0.
    std = np.sqrt(np.where(variance > ROUNDING * mean**2, variance, 1.0))
    statistics = dict(zip(channels, zip(mean.tolist(), std.tolist(), strict=True), strict=True))
    return card.completed(
        mean=tuple(statistics[name][0] for name in CHANNELS_OF_STATISTICS),
        std=tuple(statistics[name][1] for name in CHANNELS_OF_STATISTICS),
        range=statistics["range"],
        extra={name: statistics[name] for name in extra},
        rain_share=rain / max(judged, 1) if labelled else None,
    )


def _refuse_missing(channels: Sequence[str], count: NDArray[np.float64]) -> None:
    for name, known in zip(channels, count, strict=True):
        if not known:
            raise InputError(
                f"channel '{name}'",
                "no training scan holds a number of that name",
                "Name columns of the scans, with data.loading.columns where files do not.",
            )
