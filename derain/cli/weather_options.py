"""Options of the weather that a recording shows, and the table of it."""

import argparse
import csv
import io
import os
import sys
from collections.abc import Iterable, Iterator, Sequence
from contextlib import contextmanager
from pathlib import Path

import numpy as np

from derain.cli.options import count
from derain.errors import InputError
from derain.files.atomic import require_writable, write_text
from derain.files.reading import is_file, reading
from derain.sources.folders import named_frames
from derain.sources.spread import evenly_spaced
from derain.sources.weather_monitor import WeatherMonitor, WeatherOptions
from derain.system.notices import warn
from derain.weather.alarm import ERROR, HOLD, WARNING, Level, Threshold
from derain.weather.record import WEATHER_COLUMNS
from derain.weather.scan_weather import ScanWeather, dry_reach
from derain.weather.visibility import Visibility

# Exit code of a run that cleaned every scan, where one was at the level of `--fail-at` or worse.
# An error of the run itself is 2.
BAD_WEATHER = 3

# The head of a table of the weather, by which one that is there already is recognised.
TABLE_HEAD = ["scan", "time_s", *WEATHER_COLUMNS]
FIRST_COLUMNS = b"scan,time_s,"

# At most this many scans of a dry reference are read, evenly spread over it.
DRY_SCANS = 100


def add_weather(parser: argparse.ArgumentParser) -> None:
    """Declares the table of the weather, and the levels of its visibility."""
    group = parser.add_argument_group("weather")
    group.add_argument(
        "--weather", type=Path, metavar="CSV", help="write the weather of each scan to a table"
    )
    group.add_argument(
        "--dry",
        type=Path,
        metavar="REFERENCE",
        help="dry scans of the same sensor in the same kind of place (a file, folder or bag): the "
        "level then also depends on the loss of range",
    )
    for name, level in (("warning", WARNING), ("error", ERROR)):
        group.add_argument(
            f"--{name}",
            nargs=2,
            type=float,
            metavar=("BELOW", "ABOVE"),
            default=(level.below, level.above),
            help=f"raise below BELOW m of visibility, clear at ABOVE m "
            f"(default: {level.below:g} {level.above:g})",
        )
    group.add_argument(
        "--hold",
        type=count,
        default=HOLD,
        metavar="SCANS",
        help="consecutive scans that change the alarm of a recording (default: %(default)s)",
    )
    group.add_argument(
        "--fail-at",
        choices=[str(level) for level in Level if level],
        metavar="LEVEL",
        help=f"exit with code {BAD_WEATHER} if a scan is at LEVEL (warning or error) or worse: by "
        "the alarm in a recording, otherwise by the scan alone",
    )


def weather_of(arguments: argparse.Namespace) -> WeatherOptions:
    """The weather options of the arguments.

    Raises:
        InputError: Levels that cannot be, or a dry reference that cannot be read.
    """
    asking = (arguments.weather, arguments.fail_at, arguments.dry)
    every_scan = arguments.json or any(each is not None for each in asking)
    warning, error = Threshold(*arguments.warning), Threshold(*arguments.error)
    dry = None
    if arguments.dry is not None:
        dry = _dry_reach(arguments.dry, arguments.columns, warning, error)
    return WeatherOptions(every_scan, warning, error, arguments.hold, dry)


def warn_of_bad_weather(weather: WeatherMonitor, fail_at: str | None) -> int:
    """Prints how many scans were at a level or worse.

    Args:
        weather: The weather of all scans.
        fail_at: Name of the level; None for none.

    Returns:
        The exit code: BAD_WEATHER where there are such scans, else 0.
    """
    if fail_at is None:
        return 0
    worst = Level[fail_at.upper()]
    scans = sum(weather.scans_at[level] for level in Level if level >= worst)
    if not scans:
        return 0
    of_all = f"{scans:,} of {weather.scans_at.total():,} scans"
    worse = " or worse" if worst < max(Level) else ""
    print(f"derain: the weather was at {worst}{worse} in {of_all}", file=sys.stderr)
    return BAD_WEATHER


@contextmanager
def weather_table(path: Path | None, results: Iterable[Path]) -> Iterator[list[Sequence[object]]]:
    """Lends a list of rows, and writes them as a table when the block ends.

    If the block fails, a table of as many rows or more that is there already stays.

    Args:
        path: The file; None writes none.
        results: Files that the block may write.

    Raises:
        InputError: Some other file or a folder is or will be there, or the file cannot be written.
    """
    rows: list[Sequence[object]] = []
    if path is None:
        yield rows
        return
    remedy = "Give --weather another file."
    inside = (result for result in results if path.name in result.parts)
    places = (place for result in inside for place in (result, *result.parents))
    namesakes = (place for place in places if place.name == path.name)
    if os.path.realpath(path) in map(os.path.realpath, namesakes):
        raise InputError(path, "is a file or a folder of the results", remedy)
    lines = 0
    if is_file(path):
        with reading(path), path.open("rb") as file:
            if file.read(len(FIRST_COLUMNS)) not in (FIRST_COLUMNS, b""):
                raise InputError(path, "exists, and is not a table of the weather", remedy)
            lines = sum(1 for _ in file)
    require_writable(path)
    is_whole = False
    try:
        yield rows
        is_whole = True
    finally:  # scans cleaned before an error or the end of a pipe have their lines
        if is_whole or lines <= len(rows):
            table = io.StringIO()
            csv.writer(table, lineterminator="\n").writerows([TABLE_HEAD, *rows])
            write_text(path, table.getvalue(), newline="")


def _dry_reach(
    reference: Path, columns: Sequence[str], warning: Threshold, error: Threshold
) -> Visibility:
    """The reach of the dry reference; at most DRY_SCANS of its scans are read.

    Raises:
        InputError: It cannot be read, or does not reach the end of any level.
    """
    frames = evenly_spaced(named_frames([reference], columns), DRY_SCANS)
    scans = (frame.read() for frame in frames)
    dry = dry_reach(ScanWeather.of(scan, np.zeros(len(scan), bool)) for scan in scans)
    if dry.at_least < min(warning.above, error.above):
        end = error.above
        reason = f"its reach is {dry}, and a dry scan has to reach {end:g} m, where the error ends"
        remedy = "Give dry scans of a wider place, or smaller numbers to --warning and --error."
        raise InputError(reference, reason, remedy)
    if dry.at_least < max(warning.above, error.above):
        warn(
            f"{reference}: its reach is {dry}, less than {warning.above:g} m, where the "
            "warning ends: what the sensor no longer reaches counts for the error alone"
        )
    return dry
