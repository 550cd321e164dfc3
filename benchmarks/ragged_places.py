"""How ragged clean scans are: the share of their points that look like drops, and how they lie.

    python benchmarks/ragged_places.py --seeds 3 ../shared/data/clean/*

A point looks like a drop where ``derain.recordings.evidence.surroundings_log_odds`` says so, which
was fitted to simulated drives: by the distance of its neighbours in steps of the rays, by how they
are scattered, and by its range, beyond 30 m hardly ever. Nothing in any of these scans is a drop.
For every real scan, and for every place as sensors see it, between 0 and 10 m, 10 and 30, beyond,
and in all: the share that looks like a drop, and the share whose neighbours are more than six steps
away, both in per cent. Of places the share of each class that looks like a drop, too.
"""

import argparse
from collections.abc import Iterator
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.files import read_scan
from derain.recordings.evidence import surroundings_log_odds
from derain.recordings.known_points import ScanPoints
from derain.recordings.surroundings import STEP_EPSILON, USUAL_STEPS, surroundings_features
from derain.scan import Scan
from derain.simulation.classes import TrackClass
from derain.simulation.layouts import LAYOUTS
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Sensor
from derain.simulation.sensor_file import load_sensor
from derain.system.cores import usable_cores

BANDS = ((0.0, 10.0), (10.0, 30.0), (30.0, np.inf), (0.0, np.inf))
ALONE = 6.0


@dataclass(frozen=True)
class Look:
    """How the distinct points of scans look, each array (M,).

    Attributes:
        like_a_drop: Whether each looks like one.
        apart: Mean distance of its neighbours, steps of the sensor's rays.
        range: Distance from the sensor, metres.
        label: Class, 0 where it is not known.
    """

    like_a_drop: NDArray[np.bool_]
    apart: NDArray[np.float64]
    range: NDArray[np.float64]
    label: NDArray[np.int64]

    @classmethod
    def of(cls, scan: Scan) -> "Look":
        """How the points of one scan look."""
        points = ScanPoints.of(scan, usable_cores())
        label = np.zeros(len(points), np.int64)
        if scan.label is not None:
            label[points.inverse] = scan.label
        apart = np.exp(surroundings_features(points)[:, 1] + USUAL_STEPS) - STEP_EPSILON
        return cls(surroundings_log_odds(points) > 0, apart, points.range, label)

    def __str__(self) -> str:
        """One row of the table."""
        return " | ".join(
            " ".join(self._share(which, *band) for band in BANDS)
            for which in (self.like_a_drop, self.apart > ALONE)
        )

    def _share(self, which: NDArray[np.bool_], near: float, far: float) -> str:
        """Share of the points between two distances, in per cent."""
        there = (self.range >= near) & (self.range < far)
        return f"{100 * which[there].mean():6.3f}" if there.any() else "     -"

    def by_class(self) -> str:
        """Share that looks like a drop of each class, in per cent, and its number of points."""
        kinds = [(kind, self.label == kind) for kind in TrackClass if (self.label == kind).any()]
        return ", ".join(
            f"{kind.name.lower()} {100 * self.like_a_drop[mine].mean():.2f} of {mine.sum():,}"
            for kind, mine in kinds
        )


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("scans", nargs="*", type=Path, help="clean real scans")
    parser.add_argument("--seeds", type=int, default=3, help="places of each kind")
    parser.add_argument("--places", nargs="*", default=list(LAYOUTS), choices=list(LAYOUTS))
    arguments = parser.parse_args()
    print(f"{'':32} like a drop: 0, 10, 30 m, all | neighbours far: 0, 10, 30 m, all")
    for path in arguments.scans:
        print(f"{path.name:32}", Look.of(read_scan(path)))
    for name, sensor in _sensors():
        for place in arguments.places:
            looks = list(_seen(place, sensor, arguments.seeds))
            look = Look(*(np.concatenate([getattr(each, x) for each in looks]) for x in FIELDS))
            print(f"{place + ' ' + name:32}", look)
            print("   ", look.by_class())


FIELDS = tuple(Look.__dataclass_fields__)


def _sensors() -> Iterator[tuple[str, Sensor]]:
    spinning = load_sensor("spinning_64")
    yield "spinning_64", spinning
    coarse = replace(spinning, rows=16, row_inclinations=(), inclination=(-15.0, 15.0))
    yield "of 16 rows", replace(coarse, columns=1800)


def _seen(place: str, sensor: Sensor, seeds: int) -> Iterator[Look]:
    """How the points look that a sensor sees of places of one kind through clear air."""
    for seed in range(seeds):
        generator = np.random.default_rng(seed)
        clear = LAYOUTS[place](generator).cast(sensor)
        seen = rain_on_beams(clear, sensor.beams(), UniformRain(0), sensor, generator)
        yield Look.of(sensor.measure(seen, generator))


if __name__ == "__main__":
    main()
