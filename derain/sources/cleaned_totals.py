"""What a job has cleaned so far: points, rain, and the weather hour by hour."""

import math
from collections import defaultdict
from datetime import UTC, datetime
from pathlib import PurePosixPath

from derain.jobs.record import Record
from derain.sources.cleaned_scan import counts, unpacked
from derain.weather.scan_weather import ScanWeather

# Seconds from which on times are those of Unix: no recording takes thirty years.
UNIX_TIMES_FROM = 1e9


class CleanedTotals:
    """Adds up the records of units.

    Attributes:
        scans: Number of cleaned scans.
        points: Number of their points.
        valid: Number of points that can be judged.
        rain: Number of removed points.
        by_hour: The weather of the measured scans of each hour, by its name: a date and an hour in
            UTC, or else the recording and the hour in it.
    """

    def __init__(self) -> None:
        self.scans = self.points = self.valid = self.rain = 0
        self.by_hour: dict[str, ScanWeather] = defaultdict(ScanWeather.none)

    def add(self, record: Record) -> None:
        """Adds the scans of a unit."""
        for scan in record.results:
            self.scans += 1
            self.points += scan["points"]
            self.valid += scan["valid"]
            self.rain += scan["rain"]
            if scan["measured"] is not None:
                hour = _hour(scan["seconds"], PurePosixPath(record.unit).parent.as_posix())
                self.by_hour[hour] += unpacked(scan["measured"])

    def worst_hours(self, most: int = 3) -> list[tuple[str, ScanWeather]]:
        """The hours with the shortest visibility, the worst first.

        Args:
            most: At most so many.
        """
        known = [each for each in self.by_hour.items() if each[1].visibility.known]
        return sorted(known, key=lambda each: each[1].visibility.shown)[:most]

    def __str__(self) -> str:
        return f"{self.scans:,} scans: {counts(self.points, self.valid, self.rain)}"


def _hour(seconds: float | None, recording: str) -> str:
    """The hour of a time, by its date, or within its recording."""
    of_recording = "" if recording == "." else f"{recording}, "
    if seconds is None or not math.isfinite(seconds):
        return f"{of_recording}without times"
    if seconds < UNIX_TIMES_FROM:
        return f"{of_recording}hour {int(seconds // 3600)}"
    try:
        return datetime.fromtimestamp(seconds, UTC).strftime("%Y-%m-%d %H:00 UTC")
    except (OverflowError, ValueError, OSError):  # for instance nanoseconds
        return f"{of_recording}without times in seconds"
