"""What ``derain info`` says of the returns of a scan."""

from typing import Any

from derain.cards.card import DataCard
from derain.evaluation.ray_counts import RayCounts
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.views.returns import pair_returns


def facts_of_returns(scan: Scan, frame: Frame, card: DataCard | None) -> dict[str, Any] | str:
    """How many rays have two returns, and what lies behind rain where labels tell.

    Args:
        scan: The scan.
        frame: Where it and its labels are from.
        card: Says which labels are rain; None where nobody does.

    Raises:
        InputError: Labels that are damaged or not one for each point.
    """
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
