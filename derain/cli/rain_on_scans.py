"""Lets it rain on clean scans: ``derain simulate --on``."""

import argparse
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.cli.outputs import folder_sink, noting_what_is_written, tell
from derain.cli.scan_by_scan import ScanByScan
from derain.errors import InputError, printable
from derain.scan import Scan
from derain.simulation.classes import TrackClass
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan
from derain.simulation.sensor import Sensor
from derain.simulation.sensor_file import load_sensor
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.sink import FolderSink


@dataclass(frozen=True)
class Rained:
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


def rain_on_scans(arguments: argparse.Namespace) -> int:
    """Runs the command.

    Args:
        arguments: Of ``derain simulate``.

    Returns:
        Exit code: 2 where a scan was passed over, else 0.

    Raises:
        InputError: An impossible rate, no such sensor, no scans, or an output that would overwrite
            them.
    """
    if not arguments.rain or len(arguments.rain) > 1:
        raise InputError("--rain", "it rains on scans at one rate", "Give one, e.g. --rain 25.")
    rain, sensor = UniformRain(arguments.rain[0]), load_sensor(arguments.sensor or "spinning_64")
    source = named_frames(arguments.on, arguments.columns)
    sink = folder_sink(arguments.out, source)
    scans, written = ScanByScan(source), 0
    with noting_what_is_written(lambda: f"{written:,} of {len(source):,} scans are written"):
        for number, frame in enumerate(scans):
            seed = np.random.SeedSequence(arguments.seed, spawn_key=(number,))
            with scans.passing_over(frame):
                generator = np.random.default_rng(seed)
                rained = _rain_on(frame, rain, sensor, generator, sink, arguments.picture)
                written += 1
                tell(rained, arguments.json)
    return scans.exit_code("it could not rain on {scans}")


def _rain_on(
    frame: Frame,
    rain: UniformRain,
    sensor: Sensor,
    generator: np.random.Generator,
    sink: FolderSink,
    picture: bool,
) -> Rained:
    clean = frame.read()
    rainy = rain_on_scan(clean, rain, sensor, generator)
    assert rainy.label is not None  # rain comes with labels
    drops = rainy.label == TrackClass.RAIN
    sink.write(frame, rainy, drops)
    if picture:
        path = sink.path(frame, ".png")
        _draw(path, rainy, drops, f"{Path(frame.key).name} in {rain.heaviest:g} mm/h")
    before, after, new = (int(rows.sum()) for rows in (clean.valid, rainy.valid, drops))
    return Rained(frame.name, before, after, new, before - (after - new))


def _draw(path: Path, rainy: Scan, drops: NDArray[np.bool_], what: str) -> None:
    from derain.pictures.scan_pictures import before_after_figure, save

    title = f"{what} of simulated rain, and without its drops"
    save(before_after_figure(rainy, drops, title), path)
