"""Measures the reach of scans in fog that returns nothing, with and without dry scans.

python -m benchmarks.weather_fog --shared ../shared --out weather

There is no recording of fog here: it is simulated by leaving out returns of real scans. All nearer
than 20 m stay, none beyond 25 m does, and of those between so many that the share falls evenly.
Each scan is then compared to itself before, as the dry reference. On the drive, which is in snow,
the fog comes closer from scan to scan, and range alone decides: its visibility counts as clear.
No label is read. Writes weather_fog.txt to --out.
"""

import argparse
from collections.abc import Iterator, Sequence
from pathlib import Path

import numpy as np

from derain.evaluation.text_tables import plain_table
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.scan import Scan
from derain.weather.alarm import Alarm
from derain.weather.scan_weather import ScanWeather, dry_reach
from derain.weather.visibility import CLEAR_AIR, Visibility

# Metres: as far as that all returns stay, and from there on none does.
FOG = (20.0, 25.0)

# Metres at which the fog ends on the drive, from its first scan to its last.
COMES_CLOSER = (120.0, 12.0)

CLEAR = Visibility(None, CLEAR_AIR, np.inf)


def main() -> None:
    """Prints the tables."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--shared", type=Path, required=True, help="folder with data/")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument("--threads", type=int, default=2)
    arguments = parser.parse_args()
    data = arguments.shared / "data"
    drive = [read_scan(path) for path in sorted((data / "wads/drive/velodyne").glob("*.bin"))]
    text = "\n\n".join(
        [
            _clean(sorted((data / "clean").iterdir()), Derainer(threads=arguments.threads)),
            _dry_drive(drive),
            _closer(drive),
        ]
    )
    print(text)
    arguments.out.mkdir(parents=True, exist_ok=True)
    (arguments.out / "weather_fog.txt").write_text(f"{text}\n", "utf-8")


def in_fog(scan: Scan, whole: float, nothing: float) -> Scan:
    """A scan of which all returns nearer than one range stay and none beyond another does."""
    chance = (nothing - scan.range) / (nothing - whole)
    return scan.take(np.random.default_rng(0).random(len(scan)) < chance)


def _clean(paths: Sequence[Path], derainer: Derainer) -> str:
    rows = [["scan", "visibility", "dry reach", "in fog: 95 %", "99 %", "visibility", "level"]]
    rows[0] += ["beside the dry scan"]
    for path in paths:
        scan = read_scan(path)
        dry, fog = (derainer.judge(each).weather for each in (scan, in_fog(scan, *FOG)))
        seen = (fog.visibility, fog.reach)
        levels = [alarm.level_of(*seen) for alarm in (Alarm(), Alarm(dry=dry.reach))]
        figures = (dry.visibility, dry.reach, fog.range_of(0.95), fog.reach, fog.visibility)
        rows.append([path.name, *map(str, figures), *map(_level, levels)])
    return f"clean scans, returns beyond {FOG[0]:g} to {FOG[1]:g} m left out\n{plain_table(rows)}"


def _dry_drive(drive: Sequence[Scan]) -> str:
    """Change of a drive's own reach: its later half against the earlier one."""
    weathers = list(map(_without_rain, drive))
    half = len(weathers) // 2
    alarm = Alarm(dry=dry_reach(weathers[:half]))
    levels = [_level(alarm.level_of(CLEAR, weather.reach)) for weather in weathers[half:]]
    reaches = [weather.reach.shown for weather in weathers]
    counts = ", ".join(f"{levels.count(level)} {level}" for level in dict.fromkeys(levels))
    return (
        f"the drive as it is: reach {min(reaches):.1f} to {max(reaches):.1f} m; its later half "
        f"beside the earlier one: {counts}"
    )


def _closer(drive: Sequence[Scan]) -> str:
    alarm = Alarm(dry=dry_reach(map(_without_rain, drive)))
    rows = [["scan", "fog from, m", "95 %", "99 %", "level", "alarm"], *_rows(drive, alarm)]
    return f"the drive, fog comes closer, by range alone\n{plain_table(rows)}"


def _rows(drive: Sequence[Scan], alarm: Alarm) -> Iterator[list[str]]:
    for number, (scan, end) in enumerate(
        zip(drive, np.geomspace(*COMES_CLOSER, len(drive)), strict=True)
    ):
        weather = _without_rain(in_fog(scan, 0.8 * end, end))
        level = alarm.level_of(CLEAR, weather.reach)
        state = alarm.update(CLEAR, weather.reach)
        ranges = (weather.range_of(0.95), weather.reach)
        yield [f"{number}", f"{end:.0f}", *map(str, ranges), _level(level), str(state)]


def _without_rain(scan: Scan) -> ScanWeather:
    return ScanWeather.of(scan, np.zeros(len(scan), bool))


def _level(level: object) -> str:
    return "open" if level is None else str(level)


if __name__ == "__main__":
    main()
