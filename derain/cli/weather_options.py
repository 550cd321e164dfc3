"""Arguments of the weather that a recording shows, and what is told of it scan by scan."""

import argparse
import csv
import io
import sys
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Self

import numpy as np
from numpy.typing import NDArray

from derain.cli.arguments import count
from derain.cli.outputs import refuse_unwritable
from derain.errors import InputError
from derain.files.atomic import replacing
from derain.files.reading import is_file, reading
from derain.sources.frame import Frame
from derain.sources.source import Source
from derain.weather.alarm import ERROR, HOLD, WARNING, Alarm, Level, Threshold
from derain.weather.rays import RAY_SECTORS
from derain.weather.scan_weather import RANGE_BANDS, ScanWeather

# What a run ends with that cleaned every scan, where one was as bad as `--fail-at` says. An error
# of the run itself ends with 2.
BAD_WEATHER = 3

# Digits of shares: rays are a hundred thousand at most.
SHARE_DIGITS = 5

SECTOR_TITLES = [f"share_at_{360 // RAY_SECTORS * sector}_deg" for sector in range(RAY_SECTORS)]
BAND_TITLES = [f"share_from_{band}_m" for band in RANGE_BANDS]
TITLES = [
    *("scan", "time_s", "rays", "met_rain", "visibility_m", "visibility_over_m", "level"),
    *SECTOR_TITLES,
    *BAND_TITLES,
]

# How the table begins.
TABLE_HEAD = b"scan,time_s,"


@dataclass(frozen=True)
class ToldWeather:
    """What is told of the weather of one scan; None stands for what is not known.

    Attributes:
        rays: Its rays.
        met_rain: Those of them that met rain.
        visibility_m: The range that 90 % of them would get through, metres; None where it is
            farther than the scan can tell.
        visibility_over_m: What it then is at least.
        level: clear, warning or error, after the scans so far.
        shares: Share of rain in the rays that end in each sector of 30 degrees (the first ahead,
            then towards the left) and from 0, 5, 10, 20, 40 and 80 m on.
    """

    rays: int
    met_rain: int
    visibility_m: float | None
    visibility_over_m: float | None
    level: str
    shares: list[list[float | None]]

    def __str__(self) -> str:
        if self.visibility_over_m is not None:
            return f"visibility over {self.visibility_over_m:,.0f} m ({self.level})"
        known = "not known" if self.visibility_m is None else f"{self.visibility_m:,.1f} m"
        return f"visibility {known} ({self.level})"

    @classmethod
    def of(cls, weather: ScanWeather, level: str) -> Self:
        """What is told of the weather of a scan, and of the level after it."""
        seen = weather.visibility
        metres = None if seen.metres is None else round(seen.metres, 2)
        over = round(seen.at_least, 2) if seen.known and metres is None else None
        shares = [_known(row) for row in weather.shares]
        return cls(weather.rays, weather.met_rain, metres, over, level, shares)


class WeatherWatch:
    """Says how bad the weather is, scan after scan, and at the end of all.

    Args:
        arguments: Of the command.
        source: What is read.

    Raises:
        InputError: Levels that cannot be, or a table in the place of some other file.
    """

    def __init__(self, arguments: argparse.Namespace, source: Source) -> None:
        self._levels = Threshold(*arguments.warning), Threshold(*arguments.error), arguments.hold
        self._alarm = Alarm(*self._levels)
        self._sequence: str | None = None
        self._fail_at = None if arguments.fail_at is None else Level[arguments.fail_at.upper()]
        self._all, self._scans_at = ScanWeather.none(), Counter[Level]()
        self._table = _WeatherTable(arguments.weather)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Writes the table, if one is asked for, when the block ends: of the scans so far."""
        with self._table.open():
            yield

    def look(self, frame: Frame, weather: ScanWeather) -> ToldWeather:
        """Takes the weather of the next scan.

        Args:
            frame: The scan; of another sequence than the one before, its levels start anew.
            weather: What it shows.
        """
        if frame.sequence != self._sequence:
            self._sequence, self._alarm = frame.sequence, Alarm(*self._levels)
        level = self._alarm.update(weather.visibility)
        self._all, self._scans_at[level] = self._all + weather, self._scans_at[level] + 1
        told = ToldWeather.of(weather, str(level))
        self._table.add(frame, told, weather)
        return told

    def __str__(self) -> str:
        """What all scans together tell, and how many of them were at which level."""
        levels = ", ".join(f"{self._scans_at[level]:,} {level}" for level in sorted(self._scans_at))
        return f"visibility {self._all.visibility} ({levels})"

    def exit_code(self) -> int:
        """BAD_WEATHER, which is told, where it was as bad as is asked for; else 0."""
        if self._fail_at is None:
            return 0
        scans = sum(self._scans_at[level] for level in Level if level >= self._fail_at)
        if not scans:
            return 0
        of_all = f"{scans:,} of {self._scans_at.total():,} scans"
        worse = " or worse" if self._fail_at < max(Level) else ""
        print(f"derain: the weather was at {self._fail_at}{worse} in {of_all}", file=sys.stderr)
        return BAD_WEATHER


class _WeatherTable:
    """A table of the weather, a line a scan.

    Args:
        path: The file; None where nobody asks for it.
    """

    def __init__(self, path: Path | None) -> None:
        self.path = path
        self._text = io.StringIO()
        self._add = csv.writer(self._text, lineterminator="\n").writerow
        if path is not None:
            _refuse_other_file(path)

    @contextmanager
    def open(self) -> Iterator[None]:
        if self.path is None:
            yield
            return
        refuse_unwritable(self.path)
        self._add(TITLES)
        try:
            yield
        finally:  # what was cleaned before an error or the end of a pipe has its lines
            with replacing(self.path) as temporary:
                temporary.write_text(self._text.getvalue(), "utf-8", newline="")

    def add(self, frame: Frame, told: ToldWeather, weather: ScanWeather) -> None:
        if self.path is None:
            return
        of_all = (told.rays, told.met_rain, told.visibility_m, told.visibility_over_m, told.level)
        shares = _known(weather.shares_by_sector) + _known(weather.shares_by_range)
        self._add([frame.name, _time(frame), *of_all, *shares])


def add_weather(parser: argparse.ArgumentParser) -> None:
    """Declares the table of the weather, and the levels of its visibility."""
    group = parser.add_argument_group("weather")
    group.add_argument(
        "--weather", type=Path, metavar="CSV", help="write a table of the weather, a line a scan"
    )
    for name, level in (("warning", WARNING), ("error", ERROR)):
        group.add_argument(
            f"--{name}",
            nargs=2,
            type=float,
            metavar=("BELOW", "ABOVE"),
            default=(level.below, level.above),
            help=f"level of visibility: from below so many metres to so many or more (default: "
            f"{level.below:g} {level.above:g})",
        )
    group.add_argument(
        "--hold",
        type=count,
        default=HOLD,
        metavar="SCANS",
        help="scans in a row that have to agree before the level changes (default: %(default)s)",
    )
    group.add_argument(
        "--fail-at",
        choices=[str(level) for level in Level if level],
        metavar="LEVEL",
        help=f"after all scans, exit with code {BAD_WEATHER} if one was at this level or worse: "
        "warning or error",
    )


def _refuse_other_file(path: Path) -> None:
    """Refuses to write the table in place of a file that is not one."""
    if not is_file(path):
        return
    with reading(path), path.open("rb") as file:
        start = file.read(len(TABLE_HEAD))
    if start not in (TABLE_HEAD, b""):
        raise InputError(
            path, "is there already, and no table of the weather", "Give --weather another file."
        )


def _known(shares: NDArray[np.float64]) -> list[float | None]:
    """Shares of one row, None where they are not known."""
    return [None if np.isnan(share) else round(float(share), SHARE_DIGITS) for share in shares]


def _time(frame: Frame) -> float | None:
    """When a scan was taken; None where nobody says so, or where the record of it is damaged."""
    try:
        return frame.time
    except InputError:
        return None
