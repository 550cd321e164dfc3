"""The weather of a recording, scan by scan and of all scans together."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass

from derain.errors import counted
from derain.sources.frame import Frame
from derain.sources.recordings import unbroken_recordings
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.weather.alarm import ERROR, HOLD, WARNING, Alarm, Level, Threshold
from derain.weather.record import WeatherRecord
from derain.weather.scan_weather import ScanWeather
from derain.weather.visibility import Visibility

# Unless every scan is measured, this many are, spread over the recording.
SAMPLED_SCANS = 5


@dataclass(frozen=True)
class WeatherOptions:
    """Options for measuring the weather of a recording.

    Example:
        >>> dror, every = derain.FilterDerainer(derain.DROR()), WeatherOptions(every_scan=True)
        >>> report = derain.clean("scan.bin", dror, "cleaned", weather=every)
        >>> str(report.weather.total.visibility)
        '42.9 m [29.5 to 64.7 m]'

    Attributes:
        every_scan: True to measure every scan; otherwise SAMPLED_SCANS are, for the weather of
            all scans together.
        warning: Bounds of the warning.
        error: Bounds of the error.
        hold: Number of scans in a row that change the alarm.
        dry: Reach of dry scans of the same sensor; None without such a reference.
    """

    every_scan: bool = False
    warning: Threshold = WARNING
    error: Threshold = ERROR
    hold: int = HOLD
    dry: Visibility | None = None

    def new_alarm(self) -> Alarm:
        """The alarm at the start of a recording."""
        return Alarm(self.warning, self.error, self.hold, self.dry)


class WeatherMonitor:
    """Adds up the weather of one scan after the other.

    Args:
        options: Options for measuring it.
        source: The scans.

    Attributes:
        total: The weather of all measured scans together.
        scans: Number of measured scans.
        scans_at: Number of scans at each level, by the alarm of a recording, otherwise by the scan
            alone; None stands for scans whose level is open. Empty unless every scan is measured.
        sample: Keys of the scans to measure; None measures every scan.
    """

    def __init__(self, options: WeatherOptions, source: Source) -> None:
        self.total = ScanWeather.none()
        self.scans = 0
        self.scans_at = Counter[Level | None]()
        self._options = options
        self._alarm = options.new_alarm()
        self._recording: int | str = -1
        self._is_known = False  # whether any scan of the recording shows how far one sees
        self._recordings = recording_numbers(source) if options.every_scan else {}
        sampled = frozenset(frame.key for frame in evenly_spaced(source, SAMPLED_SCANS))
        self.sample = None if options.every_scan else sampled
        self._reaches: list[float] = []

    def add(
        self, frame: Frame, weather: ScanWeather, recording: str | None = None
    ) -> WeatherRecord | None:
        """Adds the weather of the next scan.

        Args:
            frame: The scan; a new recording starts with a new alarm.
            weather: Its weather.
            recording: The recording that it is of; None leaves that to the source.

        Returns:
            Its figures; None unless every scan is measured.
        """
        self.total += weather
        self.scans += 1
        if weather.reach.metres is not None:
            self._reaches.append(weather.reach.metres)
        if not self._options.every_scan:
            return None
        level = self._alarm.level_of(weather.visibility, weather.reach)
        alarm = self._alarm_after(recording or self._recordings.get(frame.key), weather)
        self.scans_at[level if alarm is None else alarm] += 1
        return WeatherRecord.of(weather, self._options.dry, level, alarm)

    def __str__(self) -> str:
        """The weather of all scans together, and the number of scans at each level."""
        if not self.scans:
            return "visibility not known"
        dry, reach = self._options.dry, ""
        if self._reaches:
            ends = dict.fromkeys(f"{end(self._reaches):.0f}" for end in (min, max))
            reach = f", reach {' to '.join(ends)} m"
            reach += "" if dry is None else f" (dry {dry})"
        text = f"visibility {self.total.visibility}{reach}"
        if not self._options.every_scan:
            return f"{text} (of {counted(self.scans, 'scan')})"
        levels = ", ".join(
            f"{self.scans_at[level]:,} {'open' if level is None else level}"
            for level in (*Level, None)
            if self.scans_at[level]
        )
        by = "rain alone" if dry is None else "rain and range"
        return f"{text} ({levels}, by {by})"

    def _alarm_after(self, recording: int | str | None, weather: ScanWeather) -> Level | None:
        """State of the alarm after a scan; None outside of any recording, and if nothing is known.

        An alarm is clear before the first scan, but a sensor that returns nothing shows no clear
        sight.
        """
        if recording is None:
            return None
        if recording != self._recording:
            self._recording, self._alarm = recording, self._options.new_alarm()
            self._is_known = False
        self._is_known |= weather.visibility.known or weather.reach.known
        level = self._alarm.update(weather.visibility, weather.reach)
        return level if self._is_known else None


def recording_numbers(source: Sequence[Frame]) -> dict[str, int]:
    """Number of the recording of each frame, by its key, without frames outside of recordings."""
    recordings = enumerate(unbroken_recordings(source))
    return {frame.key: number for number, recording in recordings for frame in recording}
