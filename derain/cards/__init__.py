"""Data cards: what must be known of a data set to train on it and to use what was trained."""

import math
from collections.abc import Mapping
from dataclasses import dataclass, field, replace
from importlib import resources
from pathlib import Path
from typing import Any

import numpy as np
import yaml
from numpy.typing import NDArray

from derain.channels import UNITS
from derain.errors import InputError
from derain.scan import Scan

# What mean and std are of, in their order.
CHANNELS = ("x", "y", "z", "intensity")


@dataclass(frozen=True)
class DataCard:
    """What must be known of a data set.

    Attributes:
        name: Name of the data set, for tables and models.
        classes: Names of its semantic classes, by id.
        rain: Ids of the classes that are to be removed.
        unknown: Ids of the classes of which it is not known whether they are rain: neither trained
            on nor measured by.
        licence: Licence of the data.
        intensity_unit: Unit or span of its intensities, such as ``0..255``.
        mean: Mean of x, y, z (metres) and intensity over the training points; None if not known.
        std: Their standard deviations; None if not known.
        range: Mean and standard deviation of range in metres; None if not known.
        extra: Mean and standard deviation of further channels, by name, such as ``doppler``.
        rain_share: Share of rain among the training points; None if not known.
        simulated: Whether its rain or snow fell in a computer; scores on it are labelled so.
        split: Sequences of ``train``, ``validation`` and ``test``; empty without an official split.
    """

    name: str
    classes: Mapping[int, str]
    rain: tuple[int, ...]
    unknown: tuple[int, ...] = ()
    licence: str = "not stated"
    intensity_unit: str = "not stated"
    mean: tuple[float, ...] | None = None
    std: tuple[float, ...] | None = None
    range: tuple[float, ...] | None = None
    extra: Mapping[str, tuple[float, float]] = field(default_factory=dict)
    rain_share: float | None = None
    simulated: bool = False
    split: Mapping[str, tuple[str, ...]] = field(default_factory=dict)

    @property
    def has_statistics(self) -> bool:
        """True where the statistics of every channel and the rain share are known."""
        return None not in (self.mean, self.std, self.range, self.rain_share)

    def statistics(self, channel: str) -> tuple[float, float]:
        """Mean and standard deviation of a channel over the training points.

        Args:
            channel: ``x``, ``y``, ``z``, ``intensity``, ``range``, or one of the extra ones.

        Raises:
            InputError: They are not known.
        """
        if channel == "range" and self.range is not None:
            mean, std = self.range
            return mean, std
        if channel in CHANNELS and self.mean is not None and self.std is not None:
            number = CHANNELS.index(channel)
            return self.mean[number], self.std[number]
        if channel in self.extra:
            return self.extra[channel]
        raise InputError(
            self.name,
            f"the data card has no statistics of {channel}",
            "Add mean and std (of x, y, z, intensity), range, or extra (by name, mean and std).",
        )

    def unit(self, channel: str) -> str:
        """Unit of a channel."""
        return self.intensity_unit if channel == "intensity" else UNITS.get(channel, "not stated")

    def rain_of(self, scan: Scan) -> NDArray[np.bool_]:
        """Which points of a labelled scan are rain, bool (N,).

        Raises:
            InputError: A scan without labels.
        """
        return self._of_classes(scan, self.rain)

    def unknown_of(self, scan: Scan) -> NDArray[np.bool_]:
        """Of which points of a labelled scan it is not known whether they are rain, bool (N,).

        Raises:
            InputError: A scan without labels.
        """
        return self._of_classes(scan, self.unknown)

    def completed(
        self, extra: Mapping[str, tuple[float, float]] = {}, **statistics: Any
    ) -> "DataCard":
        """The same card with statistics in place of those that it lacks."""
        return replace(
            self,
            extra={**extra, **self.extra},
            **{name: value for name, value in statistics.items() if getattr(self, name) is None},
        )

    def _of_classes(self, scan: Scan, ids: tuple[int, ...]) -> NDArray[np.bool_]:
        if scan.label is None:
            raise InputError(scan.name, "it has no labels", "Give its label file.")
        return np.isin(scan.label, ids)


def packaged_cards() -> dict[str, Path]:
    """Files of the data cards that come with derain, by name."""
    folder = Path(str(resources.files("derain.cards")))
    return {file.stem: file for file in sorted(folder.glob("*.yaml"))}


def load_card(name: str | Path) -> DataCard:
    """Reads a data card.

    Args:
        name: Name of a packaged card, or a YAML file with the attributes of :class:`DataCard`.

    Raises:
        InputError: No such card, or a file that is not one.
    """
    cards = packaged_cards()
    path = cards.get(str(name), Path(name))
    if not path.is_file():
        raise InputError(
            name, "no such data card", f"Give a YAML file or one of {', '.join(cards)}."
        )
    try:
        content = yaml.safe_load(path.read_text(encoding="utf-8"))
        return _card(content)
    except (yaml.YAMLError, UnicodeDecodeError, TypeError, ValueError, AttributeError) as error:
        raise InputError(
            path, f"not a data card ({error})", "It needs name, classes (id: name) and rain (ids)."
        ) from error


def _card(content: dict[str, Any]) -> DataCard:
    card = DataCard(
        **{
            **content,
            "classes": {int(id_): str(name) for id_, name in content.get("classes", {}).items()},
            "rain": tuple(int(id_) for id_ in content.get("rain", ())),
            "unknown": tuple(int(id_) for id_ in content.get("unknown", ())),
            "split": {part: _names(names) for part, names in content.get("split", {}).items()},
            "mean": _numbers(content.get("mean"), CHANNELS),
            "std": _numbers(content.get("std"), CHANNELS),
            "range": _numbers(content.get("range"), ("mean", "std")),
            "extra": {
                str(name): _numbers(numbers, ("mean", "std"))
                for name, numbers in content.get("extra", {}).items()
            },
        }
    )
    if len(set(card.classes.values())) < len(card.classes):
        raise ValueError("two classes have the same name")
    if not set(card.rain) <= set(card.classes) or not card.rain:
        raise ValueError(f"rain {list(card.rain)} must name ids of its classes")
    if not set(card.unknown) <= set(card.classes) - set(card.rain):
        raise ValueError(f"unknown {list(card.unknown)} must name ids of its classes without rain")
    stds = [*(card.std or ()), *(card.range or ())[1:], *(std for _, std in card.extra.values())]
    if min(stds, default=1) <= 0:
        raise ValueError(f"standard deviations {stds} must be positive")
    if not isinstance(card.simulated, bool):
        raise TypeError(f"simulated is {card.simulated!r}, and must be true or false")
    if card.rain_share is not None and not 0 <= card.rain_share <= 1:
        raise ValueError(f"rain_share {card.rain_share} must be within 0 and 1")
    return card


def _numbers(values: Any, names: tuple[str, ...]) -> tuple[float, ...] | None:
    if values is None:
        return None
    numbers = tuple(map(float, values))
    if len(numbers) != len(names):
        raise ValueError(f"{list(numbers)} must be one number each for {', '.join(names)}")
    if not all(map(math.isfinite, numbers)):
        raise ValueError(f"{list(numbers)} must be finite")
    return numbers


def _names(names: Any) -> tuple[str, ...]:
    if not isinstance(names, list) or not all(isinstance(name, str) for name in names):
        raise TypeError(f"{names} must be a list of sequences, each quoted: 010 alone is a number")
    return tuple(names)
