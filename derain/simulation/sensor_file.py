"""Sensors as YAML files: those that come with derain, and a user's own."""

from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any, TypeVar, get_type_hints

from derain.errors import InputError
from derain.files.documents import Entry
from derain.files.packaged import packaged, packaged_or_own
from derain.simulation.defects import Defects
from derain.simulation.sensor import MOST_BEAMS, Pattern, ReturnMode, Sensor

# What reads a value of a document.
Parser = Callable[[Entry], Any]

Made = TypeVar("Made")


def packaged_sensors() -> dict[str, Path]:
    """Files of the sensors that come with derain, by name."""
    return packaged("derain.simulation", "sensors")


def load_sensor(name: str | Path) -> Sensor:
    """Reads a sensor.

    Args:
        name: Name of a packaged sensor, or a YAML file with attributes of :class:`Sensor`; those
            that it leaves out have their defaults.

    Raises:
        InputError: No such sensor, or a file that does not describe one.
    """
    path = packaged_or_own(name, packaged_sensors(), "sensor")
    values = Entry.of_yaml(path).record(_SENSOR)
    try:
        return Sensor(**values)
    except InputError as error:
        raise InputError(
            path, f"{error.subject}: {error.reason}", "Take a packaged one as a pattern."
        ) from error


def read_fields(make: Callable[..., Made], entry: Entry, parsers: Mapping[str, Parser]) -> Made:
    """Makes something of what a document states; the rest has its defaults.

    Args:
        make: Takes the values by name.
        entry: A record of them.
        parsers: What reads each of them.

    Raises:
        InputError: Another key, or a value of another kind or that ``make`` refuses.
    """
    values = entry.record(parsers)
    try:
        return make(**values)
    except InputError as error:
        raise entry.fault(f"{error.subject}: {error.reason}", error.remedy) from error


# What reads a value, by its type.
PARSERS: dict[Any, Parser] = {
    tuple[float, float]: lambda entry: entry.numbers(2),
    tuple[float, ...]: Entry.numbers,
    int: lambda entry: entry.whole(1, MOST_BEAMS),
    float: Entry.number,
    ReturnMode: Entry.text,
    Pattern: Entry.text,
    Defects: lambda entry: read_fields(
        Defects, entry, dict.fromkeys(get_type_hints(Defects), Entry.number)
    ),
}
_SENSOR = {name: PARSERS[kind] for name, kind in get_type_hints(Sensor).items()}
