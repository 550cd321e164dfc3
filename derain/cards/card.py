"""Data cards: descriptions of data sets, for training on them and for using trained models."""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field, replace
from pathlib import Path
from typing import Any, Literal, TypeVar, get_args

import numpy as np

from derain.cards.layout import Layout
from derain.errors import InputError, did_you_mean
from derain.files.documents import Entry, packaged, packaged_or_own, shown
from derain.scan import LARGEST_ID, Bools, Scan
from derain.views.channels import UNITS, USUAL_CHANNELS

Parsed = TypeVar("Parsed")

# What follows for scans from the names of their folders, from the least to the most:
# nothing, what their classes are called, or also which of the classes are rain.
AutoDetect = Literal["nothing", "classes", "rain"]
AUTO_DETECTIONS: tuple[AutoDetect, ...] = get_args(AutoDetect)

SPLIT_PARTS = ("train", "validation", "test")

# What mean and std of a file are of, in their order.
CHANNELS_OF_STATISTICS = ("x", "y", "z", "intensity")

# Mean and standard deviation.
Moments = tuple[float, float]


@dataclass(frozen=True)
class DataCard:
    """The description of a data set.

    Example:
        >>> card = DataCard("my garage", classes={0: "wall", 1: "spray"}, rain=(1,))
        >>> scan = derain.Scan.of(np.ones((3, 4))).with_label(np.array([0, 1, 1]))
        >>> card.rain_of(scan)
        array([False,  True,  True])

    Attributes:
        name: Name of the data set, for tables and models.
        classes: Names of its semantic classes, by id.
        rain: Ids of the classes that are to be removed; none where the data are clean.
        unknown: Ids of the classes that may or may not be rain: neither trained
            on nor measured by.
        licence: Licence of the data.
        intensity_unit: Unit or span of its intensities, such as ``0..255``.
        moments: Mean and standard deviation of channels over the training points, by name, as far
            as they are known: ``x``, ``y``, ``z`` and ``range`` in metres, ``intensity``, and
            further ones, such as ``doppler``.
        rain_share: Share of rain among the training points; None if not known.
        simulated: True if its rain or snow is simulated; scores on it are labelled so.
        deduplicate: True if results on it count points at one position once, as those of a sensor
            that writes many points twice are published.
        split: Sequences of ``train``, ``validation`` and ``test``; empty without an official split.
        layout: Layout of its scans and labels.
        auto_detect: Conclusion if folders have the names of ``layout`` and nobody
            names a card: ``nothing``; ``classes``, the names of the classes; or ``rain``, all of
            the card.
        parts: Ids of the classes of each of several data sets that it is the card of, by name; no
            file has it.

    Raises:
        InputError: Two classes of one name; rain that is no class, or unknown that is none or rain;
            a split with other parts.
    """

    name: str
    classes: Mapping[int, str]
    rain: tuple[int, ...]
    unknown: tuple[int, ...] = ()
    licence: str = "not stated"
    intensity_unit: str = "not stated"
    moments: Mapping[str, Moments] = field(default_factory=dict)
    rain_share: float | None = None
    simulated: bool = False
    deduplicate: bool = False
    split: Mapping[str, Sequence[str]] = field(default_factory=dict)
    layout: Layout = field(default_factory=Layout)
    auto_detect: AutoDetect = "nothing"
    parts: Mapping[str, tuple[int, ...]] = field(default_factory=dict)

    def __post_init__(self) -> None:
        known, remedy = set(self.classes), "Name ids that are listed under classes."
        if len(set(self.classes.values())) < len(known):
            raise InputError("classes", "two classes have the same name", "Give each its own.")
        if not known.issuperset(self.rain):
            raise InputError("rain", f"{shown(list(self.rain))} are not all ids of classes", remedy)
        if not (known - set(self.rain)).issuperset(self.unknown):
            reason = f"{shown(list(self.unknown))} are not all ids of classes that are not rain"
            raise InputError("unknown", reason, remedy)
        for part in self.split:
            if part not in SPLIT_PARTS:
                available = f"Available: {', '.join(SPLIT_PARTS)}."
                remedy = f"{did_you_mean(part, SPLIT_PARTS)}{available}"
                raise InputError(f"split.{part}", "there is no such part", remedy)

    @property
    def title(self) -> str:
        """Its name, with a remark where the rain is simulated."""
        is_clear = "simulated" in self.name or not self.simulated
        return self.name if is_clear else f"{self.name} (simulated)"

    @property
    def has_statistics(self) -> bool:
        """True where the statistics of every usual channel and the rain share are known."""
        return self.rain_share is not None and self.moments.keys() >= set(USUAL_CHANNELS)

    def statistics(self, channel: str) -> Moments:
        """Mean and standard deviation of a channel over the training points.

        Args:
            channel: Its name.

        Raises:
            InputError: They are not known.
        """
        if channel not in self.moments:
            raise InputError(
                self.name,
                f"the data card has no statistics of {channel}",
                "Add mean and std (of x, y, z, intensity), range, or extra (by name, both).",
            )
        return self.moments[channel]

    def unit(self, channel: str) -> str:
        """Unit of a channel."""
        return self.intensity_unit if channel == "intensity" else UNITS.get(channel, "not stated")

    def rain_of(self, scan: Scan) -> Bools:
        """True for points of a labelled scan that are rain, bool (N,).

        Raises:
            InputError: A scan without labels.
        """
        return self._of_classes(scan, self.rain)

    def unknown_of(self, scan: Scan) -> Bools:
        """True for points of a labelled scan whose class is unknown, bool (N,).

        Raises:
            InputError: A scan without labels.
        """
        return self._of_classes(scan, self.unknown)

    def known_points(self, scan: Scan) -> tuple[Scan, Bools]:
        """The points of a labelled scan whose class is known.

        Returns:
            The scan of those M points, and which of them are rain, bool (M,).

        Raises:
            InputError: A scan without labels.
        """
        known = scan.take(~self.unknown_of(scan))
        return known, self.rain_of(known)

    def normalised_as(self, other: "DataCard") -> "DataCard":
        """The same card with the input's statistics of another one, and the unit they are in."""
        return replace(self, intensity_unit=other.intensity_unit, moments=other.moments)

    def completed(
        self, moments: Mapping[str, Moments], rain_share: float | None = None
    ) -> "DataCard":
        """The same card with statistics in place of those that it lacks."""
        share = rain_share if self.rain_share is None else self.rain_share
        return replace(self, moments={**moments, **self.moments}, rain_share=share)

    def _of_classes(self, scan: Scan, ids: tuple[int, ...]) -> Bools:
        if scan.label is None:
            raise InputError(scan.name, "it has no labels", "Give its label file.")
        return np.isin(scan.label, ids)


def packaged_cards() -> dict[str, Path]:
    """Files of the data cards that come with derain, by name."""
    return packaged("derain.cards")


def load_card(name: str | Path) -> DataCard:
    """Reads a data card.

    Example:
        >>> card = load_card("wads")
        >>> [card.classes[number] for number in card.rain]
        ['falling-snow']

    Args:
        name: Name of a packaged card, or a YAML file with the attributes of :class:`DataCard`. In
            place of ``moments`` it has ``mean`` and ``std``, each of x, y, z and intensity, and, as
            mean and standard deviation, ``range``, and by name ``extra``.

    Raises:
        InputError: No such card, or a file that is not one.
    """
    document = Entry.of_yaml(packaged_or_own(name, packaged_cards(), "data card"))
    channels = len(CHANNELS_OF_STATISTICS)
    parsers: dict[str, Callable[[Entry], Any]] = {
        "name": Entry.text,
        "classes": lambda entry: entry.texts_by_number(LARGEST_ID),
        "rain": _ids,
        "unknown": _ids,
        "licence": Entry.text,
        "intensity_unit": Entry.text,
        "mean": _if_known(lambda entry: entry.numbers(channels)),
        "std": _if_known(lambda entry: entry.numbers(channels, Entry.positive)),
        "range": _if_known(_mean_and_deviation),
        "extra": lambda entry: entry.each(_mean_and_deviation),
        "rain_share": _if_known(lambda entry: entry.within(0, 1)),
        "simulated": Entry.truth,
        "deduplicate": Entry.truth,
        "split": lambda entry: entry.each(Entry.texts),
        "layout": Layout.of,
        "auto_detect": lambda entry: entry.one_of(AUTO_DETECTIONS),
        "folders_tell": lambda entry: entry.one_of(AUTO_DETECTIONS),  # its name in earlier versions
    }
    found = document.record(parsers, required=["name", "classes", "rain"])
    if "folders_tell" in found:
        found["auto_detect"] = found.pop("folders_tell")
    moments = found.pop("extra", {})
    mean, std, of_range = (found.pop(name, None) for name in ("mean", "std", "range"))
    if of_range is not None:
        moments["range"] = of_range
    if mean is not None and std is not None:
        moments |= zip(CHANNELS_OF_STATISTICS, zip(mean, std, strict=True), strict=True)
    try:
        return DataCard(**found, moments=moments)
    except InputError as error:
        place = f"{document.source}: {error.subject}"
        raise InputError(place, error.reason, error.remedy) from error


def _ids(entry: Entry) -> tuple[int, ...]:
    return tuple(item.whole(0, LARGEST_ID) for item in entry.items())


def _mean_and_deviation(entry: Entry) -> tuple[float, ...]:
    numbers = entry.numbers(2)
    entry.items()[1].positive()
    return numbers


def _if_known(parser: Callable[[Entry], Parsed]) -> Callable[[Entry], Parsed | None]:
    return lambda entry: None if entry.value is None else parser(entry)
