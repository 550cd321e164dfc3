"""A stream of scans at a sensor's rate: how many are judged late, by each model.

    python -m benchmarks.stream ../shared/data/wads/sample.bin --models default version1.onnx

Scan after scan comes in ten times a second for a minute. A scan is late if it is not judged when
the next comes in; a robot would have to drop the queue behind it.
"""

import argparse
import time
from pathlib import Path

import numpy as np

from derain.export.runtime import Derainer
from derain.sources.folders import named_frames
from derain.system.memory import keep_freed_memory


def main() -> None:
    """Prints a line for each model."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scans", nargs="+", type=Path, help="scans, which come again and again")
    parser.add_argument("--models", nargs="+", default=["default"])
    parser.add_argument("--rate", type=float, default=10.0, help="scans a second")
    parser.add_argument("--seconds", type=float, default=60.0)
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    keep_freed_memory()  # as the node of ROS 2 does
    scans = [frame.read() for frame in named_frames(arguments.scans)]
    for name in arguments.models:
        derainer = Derainer(name, arguments.threads)
        derainer.warns = False
        derainer.push(scans[0])  # the first allocates memory that the others reuse
        period, delays = 1 / arguments.rate, []
        begin = time.perf_counter()
        for number in range(round(arguments.rate * arguments.seconds)):
            due = begin + number * period
            time.sleep(max(due - time.perf_counter(), 0))
            derainer.push(scans[number % len(scans)])
            delays.append(time.perf_counter() - due)
        milliseconds = 1e3 * np.array(delays)
        late = int((milliseconds > 1e3 * period).sum())
        print(
            f"{name}: {late} of {len(delays)} scans late; from arrival to answer "
            f"{np.median(milliseconds):.0f} ms (median), {milliseconds.max():.0f} ms (most)"
        )


if __name__ == "__main__":
    main()
