"""Shows the causes of different speeds of 3D-OutDet's network from process to process.

    python benchmarks/two_speeds.py outdet.onnx scan.bin --threads 2

Each setting gets processes of its own, for both are read when a process starts:

- how OpenMP's threads, which search neighbours, wait: asleep, or spinning on the cores that the
  network is to compute on (OMP_WAIT_POLICY);
- the size of memory pages: features gathered from all over a scan miss the processor's table of
  pages, unless glibc asks for large ones (GLIBC_TUNABLES).
"""

import argparse
import os
import subprocess
import sys
from pathlib import Path

import numpy as np

WAITING = {"asleep": "passive", "spinning": "active"}
PAGES = {"small pages": "glibc.malloc.hugetlb=0", "large pages": "glibc.malloc.hugetlb=1"}

# Runs in a process, and those before them.
RUNS, WARM_UP = 12, 3

ONE_PROCESS = """
import sys
import numpy as np
from derain.export.runtime import Derainer
from derain.system.stopwatch import Stopwatch
model, scan, threads, runs, warm_up = sys.argv[1:]
points = np.fromfile(scan, np.float32).reshape(-1, 4)
derainer, times = Derainer(model, int(threads)), []
for run in range(int(runs) + int(warm_up)):
    stopwatch = Stopwatch()
    derainer(points, stopwatch)
    times.append([stopwatch.milliseconds["view"], stopwatch.milliseconds["network"]])
print(*np.median(times[int(warm_up):], axis=0))
"""


def main() -> None:
    """Prints the medians of view and network, process by process, the settings taking turns."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("model", type=Path)
    parser.add_argument("scan", type=Path, help="float32 x y z intensity")
    parser.add_argument("--threads", type=int, default=2)
    parser.add_argument("--processes", type=int, default=5, help="for each setting")
    arguments = parser.parse_args()

    settings = [(wait, page) for wait in WAITING for page in PAGES]
    times: dict[tuple[str, str], list[list[float]]] = {setting: [] for setting in settings}
    for _ in range(arguments.processes):
        for setting in settings:
            times[setting].append(_one_process(arguments, *setting))
    for (waiting, pages), of_setting in times.items():
        view, network = np.transpose(of_setting)
        each = " ".join(f"{value:5.1f}" for value in sorted(network))
        print(
            f"{waiting:8} {pages:11} view {np.median(view):6.1f}  network {np.median(network):6.1f}"
            f" ms, of the processes {each}"
        )


def _one_process(arguments: argparse.Namespace, waiting: str, pages: str) -> list[float]:
    settings = {"OMP_WAIT_POLICY": WAITING[waiting], "GLIBC_TUNABLES": PAGES[pages]}
    numbers = (arguments.threads, RUNS, WARM_UP)
    command = [sys.executable, "-c", ONE_PROCESS, arguments.model, arguments.scan, *numbers]
    done = subprocess.run(
        [str(part) for part in command],
        env={**os.environ, **settings},
        capture_output=True,
        text=True,
        check=True,
    )
    return [float(number) for number in done.stdout.split()]


if __name__ == "__main__":
    main()
