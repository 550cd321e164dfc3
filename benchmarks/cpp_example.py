"""Compares the example in C++ with derain: the masks, and the time of each stage.

    cmake -S examples/cpp -B build/cpp && cmake --build build/cpp
    python -m benchmarks.cpp_example build/cpp/derain_onnx ../shared/data/wads/drive/velodyne/*.bin
    python -m benchmarks.cpp_example build/cpp/derain_onnx SCAN.bin... --model a.onnx --model b.onnx

Both clean the same scans in turns, with as many threads. Each turn begins with an untimed pass over
all scans, because the first scans of a process take longer. Prints for each model the number of
points with different labels, the median of each stage, and the ratio of the times.
"""

import argparse
import re
import subprocess
import tempfile
from pathlib import Path

import numpy as np

from derain.export.runtime import Derainer
from derain.scan import Bools, Floats
from derain.system.stopwatch import Stopwatch

STAGES = ("view", "network", "back")
PRINTED = re.compile("rain, " + ", ".join(rf"{stage} ([\d.]+) ms" for stage in STAGES))

Times = Floats  # (scans, stages), milliseconds


def main() -> None:
    """Measures, and prints a table."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("program", type=Path)
    parser.add_argument("scans", type=Path, nargs="+", metavar="SCAN.bin")
    parser.add_argument("--model", type=Path, action="append", help="(default: derain's own)")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--rounds", type=int, default=3)
    arguments = parser.parse_args()
    print("| model | who | view | network | back | ms | points | judged otherwise |")
    print("|---|---|--:|--:|--:|--:|--:|--:|")
    for model in arguments.model or [None]:
        compare(model, arguments)


def compare(model: Path | None, arguments: argparse.Namespace) -> None:
    """Prints the results of one model."""
    derainer = Derainer(model, threads=arguments.threads)
    times: dict[str, list[Times]] = {"C++": [], "derain": []}
    points = differ = 0
    for _ in range(arguments.rounds):
        labels, taken = by_program(derainer.path, arguments)
        times["C++"].append(taken)
        masks, taken = by_derain(derainer, arguments.scans)
        times["derain"].append(taken)
        points = sum(map(len, masks))
        differ += sum(int((a != b).sum()) for a, b in zip(labels, masks, strict=True))
    totals = {}
    for who, taken in times.items():
        stages = np.median(np.concatenate(taken), axis=0)
        totals[who] = np.median(np.concatenate(taken).sum(axis=1))
        cells = " | ".join(f"{one:.0f}" for one in (*stages, totals[who]))
        print(f"| {derainer.name} | {who} | {cells} | {points:,} | {differ:,} |")
    print(f"C++ takes {totals['C++'] / totals['derain']:.2f} of the time of derain")


def by_program(model: Path, arguments: argparse.Namespace) -> tuple[list[Bools], Times]:
    """The rain found by the program, and its times."""
    scans: list[Path] = arguments.scans
    with tempfile.TemporaryDirectory() as out:
        command = [arguments.program, "--threads", str(arguments.threads), model, out]
        done = subprocess.run(
            [*command, *scans, *scans], check=True, capture_output=True, text=True
        )
        labels = [np.fromfile(Path(out) / f"{scan.stem}.label", "<u4") == 1 for scan in scans]
    taken = np.array(PRINTED.findall(done.stdout), np.float64)
    return labels, taken[len(scans) :]


def by_derain(derainer: Derainer, scans: list[Path]) -> tuple[list[Bools], Times]:
    """The rain found by derain, and its times."""
    masks, taken = [], []
    for scan in (*scans, *scans):
        stopwatch = Stopwatch()
        masks.append(derainer(np.fromfile(scan, np.float32).reshape(-1, 4), stopwatch))
        taken.append([stopwatch.milliseconds[stage] for stage in STAGES])
    return masks[len(scans) :], np.array(taken[len(scans) :])


if __name__ == "__main__":
    main()
