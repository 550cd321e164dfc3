"""Times heavy rain on one scan of 217,000 beams, and ray-casting such a scan.

The mean scan of REHEARSE-3D has as many points. Memory by step is what NumPy takes at the peak;
what Open3D takes while it casts shows in that of the whole process.

python benchmarks/rain_speed.py
"""

import argparse
import resource
import tracemalloc
from collections.abc import Callable
from dataclasses import replace
from functools import partial

import numpy as np
from turns import milliseconds_in_turns

from derain.simulation.facility import lay_out_track
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import RainField, SprinkledRain, UniformRain
from derain.simulation.sensor import load_sensor

RAIN: dict[str, RainField] = {
    "even rain, 50 mm/h": UniformRain(50),
    "sprinkled rain, 50 mm/h": SprinkledRain(50),
    "sprinkled rain, 10 mm/h": SprinkledRain(10),
}


def main() -> None:
    """Prints seconds, beams a second and memory of each step, as a table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("--runs", type=int, default=7)
    arguments = parser.parse_args()

    sensor = replace(load_sensor("mems_256"), columns=848)
    beams = sensor.beams()
    track = lay_out_track(np.random.default_rng(0))
    clear = track.cast(sensor)

    def rained(rain: RainField) -> None:
        generator = np.random.default_rng(0)
        sensor.measure(rain_on_beams(clear, beams, rain, sensor, generator), generator)

    steps: dict[str, Callable[[], object]] = {
        "lay out and ray-cast": lambda: lay_out_track(np.random.default_rng(0)).cast(sensor)
    }
    steps |= {name: partial(rained, rain) for name, rain in RAIN.items()}
    print(f"{len(beams):,} beams, {np.count_nonzero(clear.returned):,} returns in clear air")
    print("| step | s | beams/s | MiB |\n|---|---:|---:|---:|")
    for name, step in steps.items():
        times = milliseconds_in_turns({name: step}, rounds=1, runs=arguments.runs)
        seconds, mebibytes = np.median(times[name]) / 1e3, _mebibytes(step)
        print(f"| {name} | {seconds:.3f} | {len(beams) / seconds:,.0f} | {mebibytes:.0f} |")
    kibibytes = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss  # on Linux
    print(f"whole process at its peak: {kibibytes / 2**10:.0f} MiB")


def _mebibytes(step: Callable[[], object]) -> float:
    tracemalloc.start()
    step()
    _, peak = tracemalloc.get_traced_memory()
    tracemalloc.stop()
    return peak / 2**20


if __name__ == "__main__":
    main()
