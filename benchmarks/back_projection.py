"""Computes the IoU of rain that a grid and a back-projection allow, with perfectly labelled pixels.

    python benchmarks/back_projection.py WADS/sample.bin
    python benchmarks/back_projection.py WADS/sequences/36/velodyne/*.bin
    python benchmarks/back_projection.py WADS/sequences/36/velodyne/*.bin --beams

Every pixel has the true label of the return that it shows; no network can do better.
"""

import argparse
from collections.abc import Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from labelled import read_labelled

from derain.cards.card import load_card
from derain.evaluation.counts import Counts
from derain.evaluation.text_tables import markdown_table
from derain.scan import Bools, Scan
from derain.system.stopwatch import Stopwatch
from derain.views.back_projection import BACK_PROJECTIONS
from derain.views.grid_fit import fit_grid
from derain.views.range_image import RangeView
from derain.views.spherical_grid import SphericalGrid, grid_of


@dataclass
class GridCounts:
    """Counts of one grid and one back-projection, over all scans."""

    points: int = 0
    hidden: int = 0
    pixels: int = 0
    empty: int = 0
    rain: Counts = field(default_factory=Counts)
    view: list[float] = field(default_factory=list)
    back: list[float] = field(default_factory=list)

    def add(self, view: RangeView, scan: Scan, rain: Bools) -> None:
        """Views a scan, labels its pixels perfectly and takes the labels back."""
        stopwatch = Stopwatch()
        with stopwatch.stage("view"):
            image = view(scan)
        score = (image.target(rain) == 1).astype(np.float32)
        with stopwatch.stage("back"):
            called = image.back(score) > 0.5
        self.points += int(scan.valid.sum())
        self.hidden += int(image.hidden.sum())
        self.pixels += image.size
        self.empty += int((~image.valid).sum())
        self.rain += Counts.of(called, rain)
        self.view.append(stopwatch.milliseconds["view"])
        self.back.append(stopwatch.milliseconds["back"])

    def cells(self) -> list[str]:
        """Its cells of the table."""
        return [
            f"{self.hidden / self.points:.1%}",
            f"{self.empty / self.pixels:.1%}",
            f"{self.rain.iou:.3f}",
            f"{np.median(self.view):.1f}",
            f"{np.median(self.back):.1f}",
        ]


def main() -> None:
    """Prints the table, or the beams."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("scans", type=Path, nargs="+", help="labelled scans of WADS")
    parser.add_argument("--repeats", type=int, default=5, help="runs of each, for the times")
    parser.add_argument("--beams", action="store_true", help="print the sensor's beams instead")
    arguments = parser.parse_args()

    scans = [read_labelled(path) for path in arguments.scans]
    fit = fit_grid(scans)
    if arguments.beams:
        print(", ".join(f"{beam:.3f}" for beam in fit.beams))
        return
    grids = {
        "even, -25..15°": SphericalGrid.even(64, 2048, (-25, 15)),
        "beams of WADS": grid_of("wads", "benchmark"),
        "fitted": fit.grid,
    }
    _print_table(grids, scans, arguments.repeats)


def _print_table(grids: dict[str, SphericalGrid], scans: Sequence[Scan], repeats: int) -> None:
    card = load_card("wads")
    rain = [card.rain_of(scan) for scan in scans]
    head = ["grid", "size", "back-projection", "points hidden", "pixels empty", "IoU"]
    body = []
    for title, grid in grids.items():
        for name in BACK_PROJECTIONS:
            view, counts = RangeView(grid, back_projection=name), GridCounts()
            for _ in range(repeats):
                for scan, truth in zip(scans, rain, strict=True):
                    counts.add(view, scan, truth)
            size = f"{grid.rows}x{grid.columns}"
            body.append([title, size, name, *counts.cells()])
    print(markdown_table([*head, "view ms", "back ms"], body))


if __name__ == "__main__":
    main()
