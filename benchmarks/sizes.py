"""Times methods on scans of 10,000 to 1,300,000 points, each alone in a process, with its memory.

    python -m benchmarks.sizes --methods default crf dror dsor ror sor ssr outdet.onnx

The scans are of one simulated street in the rain, as seen by spinning sensors of more and more
beams. All methods take turns, and a time is the least of all rounds: what else the machine does
only adds to it.
"""

import argparse
import tempfile
from collections import defaultdict
from collections.abc import Sequence
from itertools import product
from pathlib import Path

import numpy as np
import yaml

from derain.cli.main import main as derain
from derain.export.bench.bench_entries import bench_entries
from derain.export.bench.cost import Cost, Timing, measure_cost
from derain.export.machine import versions
from derain.files import read_scan, write_scan
from derain.simulation.sensor import packaged_sensors
from derain.sources.folders import frame_of
from derain.sources.frame import Frame

# Rows and columns of a sensor of which some more points return than are taken.
SENSORS = {
    10_000: (16, 1400),
    100_000: (64, 3400),
    400_000: (128, 6800),
    1_300_000: (256, 11_200),
}
SENSOR = "spinning_128"
STREET = "--layout street --rain 10 --sequences 1 --scans 1 --no-radar --workers 1 --seed 0"


def main() -> None:
    """Prints milliseconds and MiB by method and number of points, as a table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("--methods", nargs="+", required=True)
    parser.add_argument("--points", nargs="+", type=int, choices=SENSORS, default=[*SENSORS])
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    parser.add_argument("--repeats", type=int, default=4, help="in each round")
    arguments = parser.parse_args()

    entries = bench_entries(arguments.methods)
    costs: dict[tuple[str, int], list[Cost]] = defaultdict(list)
    with tempfile.TemporaryDirectory() as folder:
        frames = {points: simulated(points, Path(folder)) for points in arguments.points}
        for _, entry, points in product(range(arguments.rounds), entries, frames):
            timing = Timing([frames[points]], arguments.threads, arguments.repeats)
            costs[entry.title, points].append(measure_cost(entry, timing))
    print("| method |", " | ".join(f"{points:,}" for points in frames), "|")
    print("|---|" + "---:|" * len(frames))
    for entry in entries:
        cells = [_cell(costs[entry.title, points]) for points in frames]
        print(f"| {entry.title} |", " | ".join(cells), "|")
    print(f"{arguments.threads} threads; {versions()}")


def simulated(points: int, folder: Path) -> Frame:
    """Simulates a scan of so many points into a file of a folder."""
    rows, columns = SENSORS[points]
    sensor = yaml.safe_load(packaged_sensors()[SENSOR].read_text("utf-8"))
    description = folder / f"{points}.yaml"
    description.write_text(yaml.safe_dump({**sensor, "rows": rows, "columns": columns}))
    street = ["--out", f"{folder / str(points)}", "--sensor", f"{description}", *STREET.split()]
    assert derain(["simulate", *street]) == 0
    (file,) = (folder / str(points)).glob("sequences/*/lidar_radar_pcd/*.bin")
    scan = read_scan(file)
    kept = np.random.default_rng(0).permutation(len(scan)) < points
    assert kept.sum() == points, f"{len(scan):,} points are fewer than {points:,}"
    write_scan(folder / f"{points}.bin", scan.take(kept))
    return frame_of(folder / f"{points}.bin")


def _cell(costs: Sequence[Cost]) -> str:
    """The least time, and the largest memory."""
    milliseconds = min(cost.times.total.min() for cost in costs)
    mebibytes = max(cost.peak_memory or 0 for cost in costs)
    return f"{milliseconds:,.0f} ms, {mebibytes:,.0f} MiB"


if __name__ == "__main__":
    main()
