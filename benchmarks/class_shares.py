"""Class shares of a simulated data set beside those of REHEARSE-3D, and how far away its rain is.

derain simulate --out runs/facility --sequences 25 --scans 2
python benchmarks/class_shares.py runs/facility
"""

import argparse
from pathlib import Path

import numpy as np

from derain.cards.card import load_card
from derain.datamodules.simulated import Simulated
from derain.evaluation.contents import Contents, FrameCounting, find_sequences
from derain.sources.units import whole

# Source: data_cfg.yaml of the SalsaNext model published with REHEARSE-3D.
PUBLISHED = {
    "background": 0.4789898642533535,
    "car": 0.0014873892573668546,
    "sprinkler": 0.016727809158544674,
    "rain": 0.06638644365199696,
    "pedestrian": 0.0003290765070643694,
    "bike": 0.0005140537748007008,
    "target": 0.0004193190655167801,
    "road": 0.4351460443314561,
}

# 9.2 billion points in 42,410 scans.
# Source: REHEARSE-3D, section IV.A.
PUBLISHED_POINTS = 217_000


def main() -> None:
    """Prints both."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path, help="a data set that `derain simulate` made")
    root = parser.parse_args().root
    _print_shares(root)
    _print_distances(root)


def _print_shares(root: Path) -> None:
    sequences = find_sequences(root, load_card("simulated").layout)
    total = Contents()
    for frames, _ in sequences:
        total.add(Contents.from_json(FrameCounting().value(whole(frames))))
    clean = sum(not rate for _, rate in sequences) / len(sequences)
    print("| | simulated | REHEARSE-3D |\n|---|---|---|")
    print(f"| points per scan | {total.points / total.scans:,.0f} | {PUBLISHED_POINTS:,} |")
    print(f"| clean sequences | {clean:.0%} | 39% |")
    ours = total.as_dict(load_card("simulated").classes)["class_share"]
    for name, published in PUBLISHED.items():
        print(f"| {name} | {ours.get(name, 0):.3%} | {published:.3%} |")


def _print_distances(root: Path) -> None:
    data = Simulated(str(root), make=False)
    scans = map(data.reader.read, data.frames("test"))
    distance = np.concatenate([scan.range[data.card.rain_of(scan)] for scan in scans])
    if not len(distance):
        print("\nno rain in the test scans")
        return
    median, most = np.percentile(distance, [50, 90])
    print(f"\ndistance of rain in the test scans: median {median:.1f} m, 90 % within {most:.1f} m")


if __name__ == "__main__":
    main()
