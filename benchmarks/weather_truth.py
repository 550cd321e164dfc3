"""Compares visibility with a known truth, with and without the rays that return nothing.

python -m benchmarks.weather_truth --out weather

Rain of several rates falls on simulated places. The visibility of the same rays in the open, where
only drops return anything, depends on the sensor and the rain alone: this is the truth for the
figure of a place. The simulation counts the rays that returned nothing, which a recording does not
hold. Writes weather_truth.txt to --out.
"""

import argparse
from collections.abc import Iterator
from pathlib import Path

import numpy as np
from tqdm import tqdm

from derain.evaluation.text_tables import plain_table
from derain.export.runtime import Derainer
from derain.scan import Bools, Floats, Scan
from derain.simulation.arrays import Returns
from derain.simulation.classes import TrackClass
from derain.simulation.layouts import LAYOUTS
from derain.simulation.rain import rain_on_beams
from derain.simulation.rain_field import UniformRain
from derain.simulation.sensor import Sensor, load_sensor
from derain.weather.scan_weather import ScanWeather
from derain.weather.visibility import visibility_of

SENSORS = ("spinning_32", "spinning_64", "spinning_64_far", "mems_64")
PLACES = ("street", "city", "country")
RATES = (2.0, 10.0, 50.0)

# The recall of the model is counted from here to there, metres.
BANDS = ((0, 5), (5, 10), (10, 20))
FEWEST_DROPS = 30

# Visibility in a scan by its labels as they are, by them with the rays that returned nothing,
# and by the model.
WAYS = ("labels", "with missing", "default")


def main() -> None:
    """Prints a table of all places, and how far each way is from the truth."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    derainer = Derainer(threads=arguments.threads)
    titles = ["sensor", "place", "mm/h", "missing", "in the open", *WAYS]
    rows = [[*titles, *(f"recall {near}-{far} m" for near, far in BANDS)]]
    ratios: list[list[float]] = []
    for name in tqdm(SENSORS, desc="sensors", disable=None):
        for row, ratio in _rows(load_sensor(name), derainer):
            rows.append([name, *row])
            ratios.append(ratio)
    text = f"{plain_table(rows)}\n\n{_together(np.log(np.array(ratios)))}"
    print(text)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "weather_truth.txt").write_text(f"{text}\n", "utf-8")


def _together(off: Floats) -> str:
    """How far each way is from the truth, and from place to place, by the logarithms of ratios."""
    by_place = off.reshape(len(SENSORS), len(PLACES), len(RATES), len(WAYS))
    spread = by_place.max(axis=1) - by_place.min(axis=1)
    means = {
        "times too long or too short": np.abs(off).mean(axis=0),
        "largest of the places over the smallest": spread.mean(axis=(0, 1)),
    }
    rows = [[title, *(f"{times:.2f}" for times in np.exp(mean))] for title, mean in means.items()]
    return plain_table([["geometric means", *WAYS], *rows])


def _rows(sensor: Sensor, derainer: Derainer) -> Iterator[tuple[list[str], list[float]]]:
    """A row for each place and rate, and the ratio of each way to the truth."""
    beams = sensor.beams()
    in_the_open = _nothing(len(beams), sensor)
    for place in PLACES:
        clear = LAYOUTS[place](np.random.default_rng(3)).cast(sensor)
        for rate in RATES:
            truth = _visibility(*_scan(in_the_open, beams, rate, sensor), len(beams))[1]
            scan, rain = _scan(clear, beams, rate, sensor)
            by_model = derainer(scan)
            measured = [
                *_visibility(scan, rain, len(beams)),
                _visibility(scan, by_model, len(beams))[0],
            ]
            recalls = [_recall(by_model, scan, rain, *band) for band in BANDS]
            missing = f"{1 - len(scan) / len(beams):.0%}"
            visibilities = [f"{metres:.1f} m" for metres in (truth, *measured)]
            row = [place, f"{rate:g}", missing, *visibilities, *recalls]
            yield row, [metres / truth for metres in measured]


def _recall(by_model: Bools, scan: Scan, rain: Bools, near: int, far: int) -> str:
    """Share of the drops from here to there that the model finds; "-" for few."""
    asked = rain & (scan.range >= near) & (scan.range < far)
    return f"{by_model[asked].mean():.0%}" if asked.sum() >= FEWEST_DROPS else "-"


def _nothing(count: int, sensor: Sensor) -> Returns:
    """Beams that meet nothing."""
    none = np.zeros(count, np.int64)
    return Returns(np.full(count, sensor.maximum_range), 0.0 * none, none, np.arange(count))


def _scan(clear: Returns, beams: Floats, rate: float, sensor: Sensor) -> tuple[Scan, Bools]:
    """A sensor's scan in rain, and its rain."""
    generator = np.random.default_rng(2)
    returns = rain_on_beams(clear, beams, UniformRain(rate), sensor, generator)
    scan = sensor.measure(returns, generator)
    return scan, scan.label == TrackClass.RAIN


def _visibility(scan: Scan, rain: Bools, beams: int) -> tuple[float, float]:
    """Visibility of a scan, and with the rays that returned nothing, metres."""
    weather = ScanWeather.of(scan, rain)
    other, met = weather.ends.sum(axis=1)
    all_rays = other.copy()
    all_rays[-1] += beams - weather.rays  # they are known to have met nothing on all of their way
    return weather.visibility.shown, visibility_of(all_rays, met).shown


if __name__ == "__main__":
    main()
