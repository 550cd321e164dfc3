"""Lets it rain on clean scans: ``derain simulate --on``."""

import argparse
import json
import sys
from dataclasses import asdict, dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from tqdm import tqdm

from derain.cli.outputs import refuse_clashes
from derain.errors import InputError, printable
from derain.files import find_scans, read_scan, write_scan
from derain.files.labels import LABEL, write_labels
from derain.files.names import beside, scan_stem
from derain.files.reading import reading
from derain.scan import Scan
from derain.simulation.classes import TrackClass
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan
from derain.simulation.sensor import Sensor, load_sensor


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
    scans = find_scans(arguments.on)
    refuse_clashes(scans, arguments.out)
    failed = 0
    for number, path in enumerate(tqdm(scans, unit="scan", disable=None)):
        chance = np.random.SeedSequence(arguments.seed, spawn_key=(number,))
        try:
            with reading(path):  # which knows what to say where the memory is full
                rained = _rain_on(path, rain, sensor, np.random.default_rng(chance), arguments)
        except InputError as error:
            failed += 1
            tqdm.write(f"derain: {error}", sys.stderr)
            continue
        tqdm.write(json.dumps(asdict(rained)) if arguments.json else str(rained), sys.stdout)
    if failed:
        print(f"derain: it could not rain on {failed} of {len(scans)} scans", file=sys.stderr)
    return 2 if failed else 0


def _rain_on(
    path: Path,
    rain: UniformRain,
    sensor: Sensor,
    generator: np.random.Generator,
    arguments: argparse.Namespace,
) -> Rained:
    clean = read_scan(path, arguments.columns)
    rainy = rain_on_scan(clean, rain, sensor, generator)
    assert rainy.label is not None  # rain comes with labels
    drops = rainy.label == TrackClass.RAIN
    _write(arguments.out / path.name, rainy, drops)
    if arguments.picture:
        _draw(beside(arguments.out / path.name, ".png"), rainy, drops, rain)
    before, after, new = (int(rows.sum()) for rows in (clean.valid, rainy.valid, drops))
    return Rained(str(path), before, after, new, before - (after - new))


def _write(path: Path, rainy: Scan, drops: NDArray[np.bool_]) -> None:
    """Writes the scan, then its labels: where there are labels, the scan is complete."""
    write_scan(path, rainy)
    write_labels(beside(path, LABEL), drops)


def _draw(path: Path, rainy: Scan, drops: NDArray[np.bool_], rain: UniformRain) -> None:
    from derain.pictures.scan_pictures import before_after_figure, save

    title = f"{scan_stem(path)} in {rain.heaviest:g} mm/h of simulated rain, and without its drops"
    save(before_after_figure(rainy, drops, title), path)
