"""Measures visibility, shares of rain and the alarm, on simulated rain and on real scans.

python -m benchmarks.weather --shared ../shared --out weather

Simulated rain is measured by the true labels and by the model that comes with derain; real scans by
the model, and by their labels if they have any. Labels only measure: no threshold is taken from
them. Writes weather.txt, weather.png and rose.png to --out.
"""

import argparse
import tempfile
from collections.abc import Iterable, Iterator, Sequence
from itertools import pairwise
from pathlib import Path

import numpy as np
from tqdm import tqdm

from benchmarks.turns import milliseconds_in_turns
from benchmarks.weather_pictures import draw_rose, draw_visibility
from derain.cards.card import load_card
from derain.evaluation.text_tables import plain_table
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.files.labels import label_beside, read_labels
from derain.filters import DROR, FilterDerainer
from derain.scan import Bools, Scan, class_ids
from derain.simulation.campaign import Campaign
from derain.simulation.classes import TrackClass
from derain.simulation.dataset import simulate_track
from derain.simulation.rain_field import UniformRain
from derain.simulation.recorded import rain_on_scan
from derain.simulation.sensor import load_sensor
from derain.system.memory import keep_freed_memory
from derain.weather.alarm import Alarm, Threshold
from derain.weather.scan_weather import RANGE_BANDS, ScanWeather
from derain.weather.visibility import Visibility

# Rain in mm/h, from none over light and heavy to a cloudburst.
RATES = (0.0, 2.0, 5.0, 10.0, 25.0, 50.0, 100.0)

# Simulated places, each the same at every rate: layout and sensor. And a real scan to rain on.
PLACES = (("street", "spinning_64"), ("street", "spinning_64_far"), ("facility", "mems_64"))
RAINED_ON = ("clean/kitti_hdl64.bin", "spinning_64_far")

# Levels that the drive crosses, so that it can be seen how they hold: the usual ones it does not.
CROSSED = {"warning": Threshold(12.5, 14.0), "error": Threshold(11.6, 12.2)}
HELD = 2

# Weather of a scan by its labels, and by the model.
ByBoth = tuple[ScanWeather, ScanWeather]

TITLES = ["scan", "rays", "labels", "visibility", "default", "visibility", "ahead", "behind"]


def main() -> None:
    """Prints the tables, and draws the picture."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shared", type=Path, required=True, help="folder with data/")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--speed", action="store_true", help="only time it, in turns")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()

    data, derainer = arguments.shared / "data", Derainer(threads=arguments.threads)
    if arguments.speed:
        print(_speed(data, derainer, arguments.threads))
        return
    arguments.out.mkdir(parents=True, exist_ok=True)
    drive, places = list(_drive(data, derainer)), dict(_rates(data, derainer))
    tables = [_table_of_rates(title, of_place) for title, of_place in places.items()]
    text = "\n\n".join([*tables, _real(data, derainer), *_drive_tables(drive)])
    print(text)
    (arguments.out / "weather.txt").write_text(f"{text}\n", "utf-8")
    pooled = ScanWeather.none()
    for _, _, by_model in drive:
        pooled = pooled + by_model
    draw_rose(pooled, arguments.out / "rose.png")
    draw_visibility(
        {title.removesuffix(", simulated"): _seen(pairs[1:]) for title, pairs in places.items()},
        RATES[1:],
        _seen([pair for _, *pair in drive]),
        arguments.out / "weather.png",
    )


def _by_both(derainer: Derainer, scan: Scan, rain: Bools) -> ByBoth:
    """Weather of a scan by its labels and by the model."""
    return ScanWeather.of(scan, rain), derainer.judge(scan).weather


def _seen(pairs: Iterable[Iterable[ScanWeather]]) -> list[tuple[Visibility, Visibility]]:
    """The visibility of each pair of weathers."""
    return [(one.visibility, other.visibility) for one, other in pairs]


def _rates(
    data: Path, derainer: Derainer
) -> Iterator[tuple[str, list[tuple[ScanWeather, ScanWeather]]]]:
    """Each place, with the results of both at all rates."""
    for layout, sensor in PLACES:
        scans = [_simulated(layout, sensor, rate) for rate in RATES]
        yield f"{layout}, {sensor}, simulated", [_by_both(derainer, *pair) for pair in scans]
    clean, sensor = read_scan(data / RAINED_ON[0]), load_sensor(RAINED_ON[1])
    rained = [
        rain_on_scan(clean, UniformRain(rate), sensor, np.random.default_rng(0)) for rate in RATES
    ]
    pairs = [_by_both(derainer, scan, scan.label == TrackClass.RAIN) for scan in rained]
    yield f"{Path(RAINED_ON[0]).name}, {RAINED_ON[1]}, simulated", pairs


def _simulated(layout: str, sensor: str, rate: float) -> tuple[Scan, Bools]:
    """A scan of one place at a rate, and its rain."""
    campaign = Campaign(1, 0, 0, scans=1, rain_rates=(rate,), sensor=sensor, layout=layout)
    with tempfile.TemporaryDirectory() as folder:
        simulate_track(Path(folder) / "track", campaign)
        (path,) = (Path(folder) / "track/sequences/000").glob("lidar*/*.bin")
        (label,) = (Path(folder) / "track/sequences/000").glob("*labels*/*.label")
        scan = read_scan(path)
        return scan, class_ids(read_labels(label, len(scan))) == TrackClass.RAIN


def _table_of_rates(title: str, of_place: Sequence[ByBoth]) -> str:
    rows, shown = [["mm/h", *TITLES[1:]]], []
    for rate, (by_labels, by_model) in zip(RATES, of_place, strict=True):
        rows.append(_row(f"{rate:g}", by_labels, by_model))
        shown.append((by_labels.visibility.shown, by_model.visibility.shown))
    for place, name in enumerate(("labels", "default")):
        falls = all(one[place] >= other[place] for one, other in pairwise(shown))
        title += f"; by {name} it {'falls with every rate' if falls else 'DOES NOT always fall'}"
    return f"{title}\n{plain_table(rows)}"


def _real(data: Path, derainer: Derainer) -> str:
    """A table of the real scans but for the drive."""
    files = [
        data / "wads/sample.bin",
        *sorted((data / "snowykitti/velodyne").glob("*.bin")),
        *sorted((data / "clean").iterdir()),
    ]
    rows = [TITLES]
    for path in tqdm(files, desc="real scans", disable=None):
        scan = read_scan(path)
        rain = _labelled(path, scan)
        by_labels = None if rain is None else ScanWeather.of(scan, rain)
        rows.append(
            _row(f"{path.parent.name}/{path.name}", by_labels, derainer.judge(scan).weather)
        )
    title = "real scans (snow in the first, simulated snow in 00000*, none in the others)"
    return f"{title}\n{plain_table(rows)}"


def _labelled(path: Path, scan: Scan) -> Bools | None:
    """The rain or snow by the labels of a scan; None without any."""
    label = label_beside(path)
    if not label.is_file():
        return None
    card = load_card("wads" if "wads" in path.parts else "kitti")
    return card.rain_of(scan.with_label(read_labels(label, len(scan))))


def _row(name: str, by_labels: ScanWeather | None, by_model: ScanWeather) -> list[str]:
    sectors = by_model.shares_by_sector
    return [
        name,
        f"{by_model.rays:,}",
        *(["-", "-"] if by_labels is None else _share_and_visibility(by_labels)),
        *_share_and_visibility(by_model),
        *("-" if np.isnan(share) else f"{share:.1%}" for share in sectors[[0, 6]]),
    ]


def _share_and_visibility(weather: ScanWeather) -> list[str]:
    return [f"{weather.met_rain / max(weather.rays, 1):.2%}", str(weather.visibility)]


def _drive(data: Path, derainer: Derainer) -> Iterator[tuple[str, ScanWeather, ScanWeather]]:
    for path in tqdm(sorted((data / "wads/drive/velodyne").glob("*.bin")), disable=None):
        scan = read_scan(path)
        rain = _labelled(path, scan)
        assert rain is not None
        yield path.stem, *_by_both(derainer, scan, rain)


def _drive_tables(drive: list[tuple[str, ScanWeather, ScanWeather]]) -> Iterator[str]:
    """The alarm on the drive, with its usual levels and with those that the drive crosses."""
    usual, holding = Alarm(), Alarm(**CROSSED, hold=HELD)
    # Without hysteresis: the end of a level is where it begins.
    begins = {name: Threshold(t.below, np.nextafter(t.below, 99)) for name, t in CROSSED.items()}
    at_once = Alarm(**begins, hold=1)
    crossed = ", ".join(f"{t.below:g}/{t.above:g}" for t in CROSSED.values())
    rows = [["scan", "labels", "default", "usual levels", crossed, "without gap and hold"]]
    for name, by_labels, by_model in drive:
        seen = by_model.visibility
        levels = [str(alarm.update(seen)) for alarm in (usual, holding, at_once)]
        rows.append([name, str(by_labels.visibility), str(seen), *levels])
    changes = [
        sum(one[column] != other[column] for one, other in pairwise(rows[1:]))
        for column in (3, 4, 5)
    ]
    rows.append(["changes", "", "", *map(str, changes)])
    yield f"alarm on the drive, by the model\n{plain_table(rows)}"
    pooled = [ScanWeather.none(), ScanWeather.none()]
    for _, *weathers in drive:
        pooled = [whole + one for whole, one in zip(pooled, weathers, strict=True)]
    shares = [["from", *(f"{band} m" for band in RANGE_BANDS)]]
    shares += [
        [name, *("-" if np.isnan(share) else f"{share:.2%}" for share in whole.shares_by_range)]
        for name, whole in zip(("labels", "default"), pooled, strict=True)
    ]
    yield f"share of snow by range, all twenty scans\n{plain_table(shares)}"
    by_sector = [["at", *(f"{30 * sector}°" for sector in range(12))]]
    by_sector += [
        [name, *(f"{share:.1%}" for share in whole.shares_by_sector)]
        for name, whole in zip(("labels", "default"), pooled, strict=True)
    ]
    title = "share of snow by sector (0° ahead, 90° left), all twenty scans"
    yield f"{title}\n{plain_table(by_sector)}"


def _speed(data: Path, derainer: Derainer, threads: int) -> str:
    """Time of the weather relative to judging a scan, as ratios of medians in one run."""
    keep_freed_memory()  # as `derain run` does
    rows = [["scan", "weather / DROR", "weather / default"]]
    dror = FilterDerainer(DROR(), threads)
    for name in ("wads/sample.bin", "wads/drive/velodyne/042223.bin", "clean/kitti_hdl64.bin"):
        scan = read_scan(data / name)
        rain = dror(scan)
        times = milliseconds_in_turns(
            {
                "weather": lambda scan=scan, rain=rain: ScanWeather.of(scan, rain),
                "dror": lambda scan=scan: dror(scan),
                "default": lambda scan=scan: derainer(scan),
            },
            rounds=15,
        )
        weather, of_dror, of_default = (float(np.median(each)) for each in times.values())
        rows.append([name, f"{weather / of_dror:.3f}", f"{weather / of_default:.3f}"])
    return plain_table(rows)


if __name__ == "__main__":
    main()
