"""The example that comes with derain: one simulated scan of rain and one of snow, with labels.

``benchmarks/make_example.py`` makes the files of ``sequences``; their data card is ``simulated``.
"""

from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Literal

from derain.cards.card import load_card
from derain.errors import InputError
from derain.files import read_scan
from derain.files.labels import read_labels
from derain.scan import Scan

# What a user calls it where others name scans.
EXAMPLE = "example"


def example_folder() -> Path:
    """The data set of the two scans."""
    return Path(str(resources.files("derain.example")))


def example_file(weather: str = "snow") -> Path:
    """The file of one of the scans.

    Args:
        weather: ``rain`` or ``snow``.

    Raises:
        InputError: Another weather.
    """
    if weather not in ("rain", "snow"):
        raise InputError("weather", f"there is no example of {weather}", "Give rain or snow.")
    return example_folder() / "sequences" / weather / "lidar_radar_pcd" / "000000.bin"


def example_scan(weather: Literal["rain", "snow"] = "snow") -> Scan:
    """A simulated scan of a street, in the rain or in the snow.

    Example:
        >>> scan = derain.example_scan("rain")
        >>> len(scan), int((scan.label == 3).sum())  # 3 is rain, on the data card `simulated`
        (12399, 772)
        >>> clean = scan.xyz[~derain.Derainer()(scan)]

    Args:
        weather: The precipitation.

    Returns:
        x, y, z in metres as seen from the sensor, intensities from 0 to 255, and labels.

    Raises:
        InputError: Another weather.
    """
    scan = read_scan(example_file(weather))
    labels = example_file(weather).parents[1] / "lidar_radar_labels" / "000000.label"
    return scan.with_label(read_labels(labels, len(scan)))


def or_example(path: Path) -> Path:
    """The folder of the example where a user names it and has nothing of that name, else the path.

    Args:
        path: A path as a user gives it.
    """
    return example_folder() if str(path) == EXAMPLE and not path.exists() else path


@dataclass
class Truth:
    """How much of the example's rain was found, by its labels.

    Attributes:
        rain: Points that are rain or snow.
        found: Those of them that were called so.
        others: Points that were called so and are not.
    """

    rain: int = 0
    found: int = 0
    others: int = 0

    def add(self, scan: str, found: Path) -> None:
        """Counts the points of a scan, if it is of the example.

        Args:
            scan: Its file.
            found: The file of the labels that a method gave it, 1 for rain.
        """
        weathers: tuple[Literal["rain", "snow"], ...] = ("rain", "snow")
        for weather in weathers:
            if scan == str(example_file(weather)):
                is_rain = load_card("simulated").rain_of(example_scan(weather))
                called = read_labels(found, len(is_rain)).astype(bool)
                self.rain += int(is_rain.sum())
                self.found += int((called & is_rain).sum())
                self.others += int((called & ~is_rain).sum())

    def __str__(self) -> str:
        share = self.found / max(self.rain, 1)
        return (
            f"By the example's labels {self.rain:,} points are rain or snow: {self.found:,} of "
            f"them were removed ({share:.1%}), and {self.others:,} others."
        )
