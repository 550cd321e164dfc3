"""Simulates the example that comes with derain: one scan of rain and one of snow, labelled.

python -m benchmarks.make_example --out derain/example/sequences
"""

import argparse
from pathlib import Path

import numpy as np

from derain.cards.card import load_card
from derain.files import write_scan
from derain.files.labels import write_labels
from derain.simulation.classes import unpacked
from derain.simulation.drawn_sensor import SensorSpans
from derain.simulation.flying.precipitation import KINDS
from derain.simulation.world import World, draw_scan

# A sensor that looks ahead, of 64 rows of 330 steps.
SENSOR = SensorSpans(
    kinds={"front": 1.0},
    front_rows=(64,),
    front_width=(99.0, 99.0),
    front_height=(25.0, 25.0),
    front_step=(0.3, 0.3),
    returns={"strongest": 1.0},
    head_down=0.0,
)
SEED = 5  # of both: one street in the rain, and in the snow


def main() -> None:
    """Writes the scans and their labels."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    out: Path = parser.parse_args().out
    folders = load_card("simulated").layout
    for kind in ("rain", "snow"):
        weather = {kind: KINDS[kind]}
        world = World(places={"street": 1.0}, carrier=0.0, sensors=SENSOR, precipitation=weather)
        scan, _ = draw_scan(world, np.random.default_rng(SEED))
        assert scan.label is not None  # a simulated scan is labelled
        write_scan(out / kind / folders.scans / "000000.bin", scan)
        write_labels(out / kind / folders.labels / "000000.label", *unpacked(scan.label))
        print(f"{kind}: {len(scan):,} points")


if __name__ == "__main__":
    main()
