"""Counts the returns of dual-return rays that are snow, on labelled scans.

python benchmarks/dual_returns.py WADS/drive/velodyne/0422{23,28,33}.bin
"""

import argparse
from pathlib import Path

import numpy as np
from labelled import read_labelled

from derain.cards.card import load_card
from derain.evaluation.ray_counts import RayCounts
from derain.evaluation.text_tables import plain_table
from derain.scan import Scan
from derain.views.morton import first_rows
from derain.views.returns import pair_returns

# Returns at least so far apart are of two things for certain, metres.
FAR_APART = 2.0

TITLES = [
    *("scan", "told by", "rays", "two returns", "nearer is snow", f"{FAR_APART:g} m apart"),
    *("farther is snow", "only is snow", "snow on such rays", "of all rows", "met snow"),
    *("given back", "share"),
]


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("scans", type=Path, nargs="+")
    parser.add_argument("--card", default="wads", help="says which labels are snow")
    arguments = parser.parse_args()

    card = load_card(arguments.card)
    rows = [TITLES]
    for path in arguments.scans:
        scan = read_labelled(path)
        rows.append([path.stem, *_row(scan, card.rain_of(scan))])
    print(plain_table(rows))


def _row(scan: Scan, snow: np.ndarray) -> list[str]:
    returns = pair_returns(scan)
    counts = RayCounts.of(scan, returns, snow)
    distinct = np.zeros(len(scan), bool)
    distinct[first_rows(scan)] = True
    nearer, farther = distinct & returns.nearer, distinct & returns.farther
    several = returns.nearer | returns.farther
    apart = nearer & (returns.partner_range - scan.range > FAR_APART)

    def share(some: np.ndarray, of: np.ndarray) -> str:
        return f"{(some & of).sum() / max(of.sum(), 1):.1%}"

    return [
        returns.found_by or "-",
        f"{counts.rays:,}",
        f"{counts.dual_share:.1%}",
        share(snow, nearer),
        share(snow, apart),
        share(snow, farther),
        share(snow, distinct & ~several),
        share(several, distinct & snow),
        share(several, snow),
        f"{counts.met_rain:,}",
        f"{counts.given_back:,}",
        f"{counts.given_back_share:.1%}",
    ]


if __name__ == "__main__":
    main()
