"""Arguments of the weather that a recording shows, and what is printed of it scan by scan."""

import argparse
import csv
import io
import sys
from collections import Counter
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from functools import partial
from pathlib import Path

import numpy as np

from derain.cli.arguments import count
from derain.cli.told_weather import WEATHER_COLUMNS, ToldWeather, row_of
from derain.errors import InputError
from derain.files.atomic import refuse_unwritable, replacing
from derain.files.reading import is_file, reading
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.recordings import unbroken_recordings
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.system.notices import warn
from derain.weather.alarm import ERROR, HOLD, WARNING, Alarm, Level, Threshold
from derain.weather.scan_weather import ScanWeather, dry_reach
from derain.weather.visibility import Visibility

# What a run ends with that cleaned every scan, where one was as bad as `--fail-at` says. An error
# of the run itself ends with 2.
BAD_WEATHER = 3

# Without an option that asks for the weather, it is computed for so many scans of a run.
SAMPLED_SCANS = 5

# How a table of the weather begins, by which one that is there already is known.
TABLE_HEAD = ["scan", "time_s", *WEATHER_COLUMNS]
FIRST_COLUMNS = b"scan,time_s,"

# So many scans of a dry reference are read, evenly spread over it.
DRY_SCANS = 100


class WeatherWatch:
    """The weather of scan after scan, and at the end that of all.

    It is computed for every scan where an option asks for it, and else for a few scans of a run.

    Args:
        arguments: Of the command.
        source: What is read.

    Raises:
        InputError: Levels that cannot be, a dry reference that cannot be read, or a table in the
            place of some other file.
    """

    def __init__(self, arguments: argparse.Namespace, source: Source) -> None:
        asking = (arguments.weather, arguments.fail_at, arguments.dry)
        self._asked = arguments.json or any(each is not None for each in asking)
        levels = Threshold(*arguments.warning), Threshold(*arguments.error)
        self._dry = None if arguments.dry is None else _dry_reach(arguments, levels)
        self._new_alarm = partial(Alarm, *levels, arguments.hold, self._dry)
        self._alarm, self._recording = self._new_alarm(), -1
        self._recordings = _numbers_of_recordings(source) if self._asked else {}
        sampled = 0 if self._asked or len(source) == 1 else SAMPLED_SCANS
        self._sample = {frame.key for frame in evenly_spaced(source, sampled)}
        self._fail_at = None if arguments.fail_at is None else Level[arguments.fail_at.upper()]
        self._all, self._scans_at = ScanWeather.none(), Counter[Level | None]()
        self._reaches: list[float] = []
        self._scans = 0
        self._table = _WeatherTable(arguments.weather)

    @contextmanager
    def writing(self) -> Iterator[None]:
        """Writes the table, if one is asked for, when the block ends: of the scans so far."""
        with self._table.open():
            yield

    def wants(self, frame: Frame) -> bool:
        """Whether the weather of a scan is to be computed."""
        return self._asked or frame.key in self._sample

    def look(self, frame: Frame, weather: ScanWeather) -> ToldWeather | None:
        """Takes the weather of the next scan for which it is wanted.

        Args:
            frame: The scan; of another recording than the one before, its alarm starts anew.
            weather: What it shows.

        Returns:
            What is printed of it; None where it is only one of a sample.
        """
        self._all += weather
        self._scans += 1
        if weather.reach.metres is not None:
            self._reaches.append(weather.reach.metres)
        if not self._asked:
            return None
        level = self._alarm.level_of(weather.visibility, weather.reach)
        alarm = self._alarm_after(frame, weather)
        self._scans_at[level if alarm is None else alarm] += 1
        told = ToldWeather.of(weather, self._dry, level, alarm)
        self._table.add(frame, told, weather)
        return told

    def __str__(self) -> str:
        """What all scans together show, and how many of them were at which level."""
        if not self._scans:
            return "visibility not known"
        reach = ""
        if self._reaches:
            ends = dict.fromkeys(f"{end(self._reaches):.0f}" for end in (min, max))
            reach = f", reach {' to '.join(ends)} m"
            reach += "" if self._dry is None else f" (dry {self._dry})"
        told = f"visibility {self._all.visibility}{reach}"
        if not self._asked:
            return f"{told} (of {self._scans} scans)"
        levels = ", ".join(
            f"{self._scans_at[level]:,} {'open' if level is None else level}"
            for level in (*Level, None)
            if self._scans_at[level]
        )
        by = "rain alone" if self._dry is None else "rain and range"
        return f"{told} ({levels}, by {by})"

    def exit_code(self) -> int:
        """BAD_WEATHER, which is printed, where it was as bad as is asked for; else 0."""
        if self._fail_at is None:
            return 0
        scans = sum(self._scans_at[level] for level in Level if level >= self._fail_at)
        if not scans:
            return 0
        of_all = f"{scans:,} of {self._scans_at.total():,} scans"
        worse = " or worse" if self._fail_at < max(Level) else ""
        print(f"derain: the weather was at {self._fail_at}{worse} in {of_all}", file=sys.stderr)
        return BAD_WEATHER

    def _alarm_after(self, frame: Frame, weather: ScanWeather) -> Level | None:
        """State of the alarm after a scan; None of a scan that is of no recording."""
        recording = self._recordings.get(frame.key)
        if recording is None:
            return None
        if recording != self._recording:
            self._recording, self._alarm = recording, self._new_alarm()
        return self._alarm.update(weather.visibility, weather.reach)


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
        self._add(TABLE_HEAD)
        try:
            yield
        finally:  # what was cleaned before an error or the end of a pipe has its lines
            with replacing(self.path) as temporary:
                temporary.write_text(self._text.getvalue(), "utf-8", newline="")

    def add(self, frame: Frame, told: ToldWeather, weather: ScanWeather) -> None:
        if self.path is None:
            return
        self._add([frame.name, _time(frame), *row_of(told, weather)])


def add_weather(parser: argparse.ArgumentParser) -> None:
    """Declares the table of the weather, and the levels of its visibility."""
    group = parser.add_argument_group("weather")
    group.add_argument(
        "--weather", type=Path, metavar="CSV", help="write a table of the weather, a line a scan"
    )
    group.add_argument(
        "--dry",
        type=Path,
        metavar="REFERENCE",
        help="dry scans of the same sensor in the same kind of place, a file, a folder or a bag: "
        "what the sensor no longer reaches counts for the level too",
    )
    for name, level in (("warning", WARNING), ("error", ERROR)):
        group.add_argument(
            f"--{name}",
            nargs=2,
            type=float,
            metavar=("BELOW", "ABOVE"),
            default=(level.below, level.above),
            help=f"level of visibility: it begins below so many metres and ends at so many or more "
            f"(default: {level.below:g} {level.above:g})",
        )
    group.add_argument(
        "--hold",
        type=count,
        default=HOLD,
        metavar="SCANS",
        help="scans in a row of a recording that have to agree before its alarm changes (default: "
        "%(default)s)",
    )
    group.add_argument(
        "--fail-at",
        choices=[str(level) for level in Level if level],
        metavar="LEVEL",
        help=f"after all scans, exit with code {BAD_WEATHER} if one was at this level or worse: "
        "warning or error, by the alarm in a recording, else by the scan alone",
    )


def _refuse_other_file(path: Path) -> None:
    """Refuses to write the table in place of a file that is not one."""
    if not is_file(path):
        return
    with reading(path), path.open("rb") as file:
        start = file.read(len(FIRST_COLUMNS))
    if start not in (FIRST_COLUMNS, b""):
        raise InputError(
            path, "is there already, and no table of the weather", "Give --weather another file."
        )


def _dry_reach(arguments: argparse.Namespace, levels: Sequence[Threshold]) -> Visibility:
    """The reach of the dry reference, of which no more than DRY_SCANS scans are read.

    Raises:
        InputError: It cannot be read, or does not reach the end of any level.
    """
    frames = evenly_spaced(named_frames([arguments.dry], arguments.columns), DRY_SCANS)
    scans = (frame.read() for frame in frames)
    dry = dry_reach(ScanWeather.of(scan, np.zeros(len(scan), bool)) for scan in scans)
    counted = [dry.at_least >= level.above for level in levels]
    if not any(counted):
        raise InputError(
            arguments.dry,
            f"its reach is {dry}, and a dry scan has to reach {levels[-1].above:g} m, where the "
            "error ends",
            "Give dry scans of a wider place, or smaller numbers to --warning and --error.",
        )
    if not all(counted):
        warn(
            f"{arguments.dry}: its reach is {dry}, less than {levels[0].above:g} m, where the "
            "warning ends: what the sensor no longer reaches counts for the error alone"
        )
    return dry


def _numbers_of_recordings(source: Source) -> dict[str, int]:
    """The number of the recording of each frame, by its key; frames of none are left out."""
    recordings = enumerate(unbroken_recordings(source))
    return {frame.key: number for number, recording in recordings for frame in recording}


def _time(frame: Frame) -> float | None:
    """When a scan was taken; None where nobody says so, or where the record of it is damaged."""
    try:
        return frame.time
    except InputError:
        return None
