"""Measures time and memory of methods on scans of 10,000 to 1,300,000 points, each in a process.

    python -m benchmarks.sizes --methods default crf dror dsor ror sor ssr outdet.onnx

The scans are of one simulated street in the rain, as seen by spinning sensors of more and more
beams. The time is what one core works on a scan, the least of several: unlike the time that passes,
it grows little when others use the machine.
"""

import argparse
import multiprocessing
import tempfile
import time
from concurrent.futures import ProcessPoolExecutor
from pathlib import Path

import numpy as np
import yaml

from derain.cli.main import main as derain
from derain.export.bench.bench_entries import BenchEntry, bench_entries
from derain.export.bench.cost import Effort, measure_in_process
from derain.export.timing import versions
from derain.files import read_scan, write_scan
from derain.simulation.sensor import packaged_sensors
from derain.sources.folders import frame_of
from derain.sources.frame import Frame
from derain.system.stopwatch import Stopwatch

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
    parser.add_argument("--repeats", type=int, default=2)
    arguments = parser.parse_args()

    with tempfile.TemporaryDirectory() as folder:
        frames = [simulated(points, Path(folder)) for points in arguments.points]
        print("| method |", " | ".join(f"{points:,}" for points in arguments.points), "|")
        print("|---|" + "---:|" * len(frames))
        for entry in bench_entries(arguments.methods):
            cells = [_cell(entry, frame, arguments.repeats) for frame in frames]
            print(f"| {entry.title} |", " | ".join(cells), "|", flush=True)
    print(versions())


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


def measured(entry: BenchEntry, frame: Frame, repeats: int) -> tuple[float, float]:
    """Measures a method in this process.

    Returns:
        The least milliseconds that a core works on the scan, from file to mask, and the largest
        memory of the process, MiB.
    """
    memory = measure_in_process(entry, [frame], Effort(threads=1, repeats=1)).peak_memory
    assert memory is not None, "this system does not measure the largest memory of a process"
    method = entry.ready(1)
    times = []
    for _ in range(repeats):
        start = time.process_time()
        method(frame.read(), Stopwatch())
        times.append(time.process_time() - start)
    return 1e3 * min(times), memory


def _cell(entry: BenchEntry, frame: Frame, repeats: int) -> str:
    with ProcessPoolExecutor(1, multiprocessing.get_context("spawn")) as pool:
        milliseconds, memory = pool.submit(measured, entry, frame, repeats).result()
    return f"{milliseconds:,.0f} ms, {memory:,.0f} MiB"


if __name__ == "__main__":
    main()
