"""The answer of a method for a scan."""

from dataclasses import dataclass
from functools import cached_property

from derain.scan import Bools, Float32s, Scan
from derain.sources.frame import Frame
from derain.weather.scan_weather import ScanWeather


@dataclass(frozen=True, eq=False)
class Judgement:
    """The answer of a method for a scan, in input order.

    Attributes:
        probability: That each point is rain, float32 (N,); 0 for rows that were not judged. Of a
            method that gives no probabilities, 1 for points that it calls rain.
        rain: True for rain, bool (N,). It is False where ``known`` is False, whatever value the
            constructor receives.
        judged: True for rows that the method saw, bool (N,): not for those that cannot be judged,
            nor for points outside the grid of an image.
        scan: The scan.
        frame: Its frame; None where points were judged by themselves.
        known: True for rows of which the method is sure, bool (N,). None for a method that is
            always sure.
    """

    probability: Float32s
    rain: Bools
    judged: Bools
    scan: Scan
    frame: Frame | None = None
    known: Bools | None = None

    def __post_init__(self) -> None:
        if self.known is not None:
            object.__setattr__(self, "rain", self.rain & self.known)

    @property
    def answered(self) -> Bools:
        """True for rows that were judged, and with certainty, bool (N,)."""
        return self.judged if self.known is None else self.judged & self.known

    @property
    def possible(self) -> Bools:
        """True for points that can be judged, bool (N,): the valid ones, and all that were."""
        return self.scan.valid | self.judged

    @property
    def share_of_rain(self) -> float:
        """Share of rain among the points that can be judged; 0 where there are none."""
        return int(self.rain.sum()) / max(int(self.possible.sum()), 1)

    @cached_property
    def weather(self) -> ScanWeather:
        """The weather of the scan: where its rays meet rain, and at what range."""
        return ScanWeather.of(self.scan, self.rain)
