"""Lets it rain on clean scans: ``derain simulate --on``."""

from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.cli.outputs import ScanByScan, exit_code, noting_progress, print_facts
from derain.errors import printable
from derain.scan import Scan
from derain.simulation.classes import TrackClass
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan
from derain.simulation.sensor import Sensor
from derain.sources.frame import Frame
from derain.sources.sink import FolderSink
from derain.sources.source import Source


@dataclass(frozen=True)
class RainedScan:
    """What the rain did to one scan.

    Attributes:
        scan: Its file.
        clean: Points that it had, those that cannot be judged left out.
        points: Points that it has in the rain, likewise.
        rain: Those of them that are drops.
        lost: Points that it had and that are gone: behind a drop, or too weak to be seen.
    """

    scan: str
    clean: int
    points: int
    rain: int
    lost: int

    def __str__(self) -> str:
        return (
            f"{printable(self.scan)}: {self.clean:,} points, in the rain {self.points:,}: "
            f"{self.rain:,} of drops, {self.lost:,} lost"
        )


def rain_on_scans(
    source: Source,
    rain: UniformRain,
    sensor: Sensor,
    sink: FolderSink,
    seed: int,
    picture: bool,
    as_json: bool,
) -> int:
    """Writes the scans in the rain, and prints what it did to each.

    Args:
        source: The clean scans.
        rain: The rain.
        sensor: The sensor that took the scans.
        sink: Takes the scans in the rain, with their labels.
        seed: Random seed.
        picture: Whether a picture of each scan is drawn.
        as_json: Whether each line is a JSON object.

    Returns:
        Exit code: 2 where a scan was passed over, else 0.
    """
    scans, written = ScanByScan(source), 0
    with noting_progress(lambda: f"{written:,} of {len(source):,} scans are written"):
        for number, frame in enumerate(scans):
            generator = np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(number,)))
            with scans.skipping_failures(frame):
                rained = _rain_on(frame, rain, sensor, generator, sink, picture)
                written += 1
                print_facts(rained, as_json)
    return exit_code(len(scans.errors), len(source), "it could not rain on {scans}")


def _rain_on(
    frame: Frame,
    rain: UniformRain,
    sensor: Sensor,
    generator: np.random.Generator,
    sink: FolderSink,
    picture: bool,
) -> RainedScan:
    clean = frame.read()
    rainy = rain_on_scan(clean, rain, sensor, generator)
    assert rainy.label is not None  # rain comes with labels
    drops = rainy.label == TrackClass.RAIN
    sink.write(frame, rainy, drops)
    if picture:
        path = sink.path(frame, ".png")
        _draw(path, rainy, drops, f"{Path(frame.key).name} in {rain.heaviest:g} mm/h")
    before, after, new = (int(rows.sum()) for rows in (clean.valid, rainy.valid, drops))
    return RainedScan(frame.name, before, after, new, before - (after - new))


def _draw(path: Path, rainy: Scan, drops: NDArray[np.bool_], what: str) -> None:
    from derain.pictures.scan_pictures import before_after_figure, save

    title = f"{what} of simulated rain, and without its drops"
    save(before_after_figure(rainy, drops, title), path)
