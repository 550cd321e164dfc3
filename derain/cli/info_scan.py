"""What ``derain info`` prints of a scan: its extent, the grid that fits, and its returns."""

from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import DataCard
from derain.evaluation.ray_counts import RayCounts
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.views.directions import directions
from derain.views.grid_fit import fit_grid
from derain.views.morton import distinct_rows
from derain.views.returns import pair_returns


def facts_of_scan(scan: Scan, frame: Frame, card: DataCard | None) -> dict[str, Any]:
    """What is in a scan.

    Args:
        scan: The scan.
        frame: The file that it and its labels are from.
        card: Tells which labels are rain; None where none does.

    Raises:
        InputError: Labels that are damaged or not one for each point.
    """
    valid = scan.valid
    points = scan.xyz[valid]
    azimuth, inclination = directions(points)
    return {
        "points": len(scan),
        "valid": int(valid.sum()),
        "distinct positions": len(distinct_rows(scan)[0]),
        "organised": "no" if scan.shape is None else f"{scan.shape[0]} x {scan.shape[1]}",
        "fields": {name: str(column.dtype) for name, column in scan.fields.items()},
        "x / m": _span(points[:, 0]),
        "y / m": _span(points[:, 1]),
        "z / m": _span(points[:, 2]),
        "range / m": _span(scan.range[valid]),
        "azimuth / deg": _span(azimuth),
        "inclination / deg": _span(inclination),
        "intensity": "none" if scan.intensity is None else _span(scan.intensity[valid]),
        "fitted grid": _fitted(scan) if valid.any() else "none",
        "returns": _returns(scan, frame, card),
    }


def _fitted(scan: Scan) -> dict[str, Any]:
    fit = fit_grid([scan]).as_dict()
    del fit["grid"]  # one number a row: of use in a configuration, for which there is --grid
    return fit


def _returns(scan: Scan, frame: Frame, card: DataCard | None) -> dict[str, Any] | str:
    """How many rays have two returns, and what lies behind rain if labels are known."""
    returns = pair_returns(scan)
    if not returns.dual:
        return "one of each ray"
    rain = None
    if card is not None and frame.has_labels:
        rain = card.rain_of(scan.with_label(frame.read_label(len(scan))))
    counts = RayCounts.of(scan, returns, rain)
    facts = {
        "told by": returns.found_by,
        "rays": counts.rays,
        "with two returns": counts.dual,
        "share": round(counts.dual_share, 4),
    }
    if rain is None:
        return facts
    return {
        **facts,
        "that met rain first": counts.met_rain,
        "with something else behind": counts.given_back,
        "share given back": round(counts.given_back_share, 4),
    }


def _span(values: NDArray[Any]) -> dict[str, float] | str:
    if not len(values):
        return "none"
    lowest, median, highest = np.percentile(values, [0, 50, 100])
    return {
        "min": round(float(lowest), 4),
        "median": round(float(median), 4),
        "max": round(float(highest), 4),
    }
