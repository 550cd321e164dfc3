"""Levels of visibility, and an alarm that does not change at every scan."""

import math
from dataclasses import dataclass
from enum import IntEnum

from derain.errors import InputError
from derain.weather.visibility import NOT_KNOWN, Visibility


class Level(IntEnum):
    """Level of visibility, in the numbers of ROS's diagnostics: OK, WARN and ERROR."""

    CLEAR = 0
    WARNING = 1
    ERROR = 2

    def __str__(self) -> str:
        return self.name.lower()


@dataclass(frozen=True)
class Threshold:
    """The visibilities at which a level begins and ends.

    Example:
        >>> alarm = Alarm(warning=Threshold(below=50, above=60), error=Threshold(10, 12), hold=3)
        >>> str(alarm.update(Visibility(45.0, 44.0, 46.0)))  # the first scan decides alone
        'warning'

    Attributes:
        below: The level begins where visibility is below this, metres.
        above: It ends where visibility is this or more, metres.

    Raises:
        InputError: Numbers that are not finite, or do not rise from 0.
    """

    below: float
    above: float

    def __post_init__(self) -> None:
        if not 0 < self.below < self.above < math.inf:
            reason = f"a level from below {self.below:g} m to {self.above:g} m or more"
            remedy = (
                "Give two numbers of metres, the second one greater than the first, e.g. 30 40."
            )
            raise InputError("alarm", reason, remedy)


# What a car needs to stop from 50 and from 30 km/h: 28 and 13 m, by one second of reaction and
# 7 m/s² on a wet road, v + v² / 14, rounded up. The gaps are a third of them.
# Source: one second is the usual assumption of driving schools; 7 m/s² is what good tyres reach.
WARNING = Threshold(30.0, 40.0)
ERROR = Threshold(15.0, 20.0)

# So many scans in a row have to agree: half a second of most sensors.
HOLD = 5


@dataclass
class Latch:
    """One level, on or off.

    Attributes:
        threshold: The bounds at which it begins and ends.
        hold: Number of consecutive scans that change it.
        on: True if it is on.
        against: Number of consecutive scans so far that agree on a change; before the first scan
            one less than ``hold``, so that it alone can change the level.
    """

    threshold: Threshold
    hold: int
    against: int
    on: bool = False

    def update(self, visibility: Visibility) -> None:
        """Takes the visibility of the next scan.

        A scan whose interval lies on both sides of the threshold changes nothing, and neither does
        a scan without a value: the count continues with the scan after it.
        """
        least, most = visibility.at_least, visibility.at_most
        if self.on:
            for_change, for_stay = least >= self.threshold.above, most < self.threshold.above
        else:
            for_change, for_stay = most < self.threshold.below, least >= self.threshold.below
        if for_change:
            self.against += 1
        if self.against == self.hold:
            self.on, self.against = not self.on, 0
        elif for_stay:
            self.against = 0


class Alarm:
    """The level of scan after scan, by the visibility and the reach of each.

    A level is entered after several scans in a row below its lower threshold, and left after as
    many at its upper one or above; in between it stays as it is. The first scan of which anything
    is known decides alone, for there is nothing to stay at.

    The reach counts where a dry reference of the sensor is given, and for the levels whose upper
    threshold the sensor reaches when dry: there the shorter of visibility and reach decides.

    Example:
        >>> alarm = Alarm(hold=2)
        >>> far, near = (Visibility(metres, metres, metres) for metres in (100.0, 12.0))
        >>> [str(alarm.update(each)) for each in (far, near, near, far, near, far, far)]
        ['clear', 'clear', 'error', 'error', 'error', 'error', 'clear']

    Args:
        warning: Bounds of the warning.
        error: Bounds of the error.
        hold: Number of consecutive scans that have to agree before the level changes; 1 changes at
            once.
        dry: The reach of the same sensor in dry scans of the same kind of place
            (:func:`~derain.weather.scan_weather.dry_reach`); None leaves reach out.

    Raises:
        InputError: An error that does not begin and end below the warning, or no whole number of
            scans.
    """

    def __init__(
        self,
        warning: Threshold = WARNING,
        error: Threshold = ERROR,
        hold: int = HOLD,
        dry: Visibility | None = None,
    ) -> None:
        if isinstance(hold, bool) or not isinstance(hold, int) or hold < 1:
            raise InputError("alarm", f"hold is {hold}", "Give a whole number of 1 or more.")
        if not (error.below < warning.below and error.above < warning.above):
            raise InputError(
                "alarm",
                f"the error (below {error.below:g}, {error.above:g} m) does not lie below the "
                f"warning (below {warning.below:g}, {warning.above:g} m)",
                "Give it smaller numbers.",
            )
        self._dry = dry
        self._latches = {
            Level.WARNING: Latch(warning, hold, hold - 1),
            Level.ERROR: Latch(error, hold, hold - 1),
        }

    @property
    def level(self) -> Level:
        """The level after the scans so far; clear before the first."""
        on = (level for level, latch in self._latches.items() if latch.on)
        return max(on, default=Level.CLEAR)

    def update(self, visibility: Visibility, reach: Visibility = NOT_KNOWN) -> Level:
        """Takes the visibility and the reach of the next scan.

        Returns:
            The level after it.
        """
        for latch in self._latches.values():
            latch.update(self._deciding(latch.threshold, visibility, reach))
        return self.level

    def level_of(self, visibility: Visibility, reach: Visibility = NOT_KNOWN) -> Level | None:
        """The level of one scan by itself, without those before it.

        Returns:
            The worst level that its whole interval lies below; None where there is none and the
            interval does not show clear sight either.
        """
        clear, level = True, Level.CLEAR
        for each, latch in self._latches.items():
            seen = self._deciding(latch.threshold, visibility, reach)
            clear = clear and seen.at_least >= latch.threshold.below
            level = each if seen.at_most < latch.threshold.below else level
        return level if level or clear else None

    def _deciding(
        self, threshold: Threshold, visibility: Visibility, reach: Visibility
    ) -> Visibility:
        """The range that decides at a threshold."""
        if self._dry is None or self._dry.at_least < threshold.above:
            return visibility
        return visibility.shorter_of(reach)
