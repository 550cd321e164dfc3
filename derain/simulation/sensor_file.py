"""Sensors as YAML files: those that come with derain, and a user's own."""

from collections.abc import Callable
from pathlib import Path
from typing import Any, get_type_hints

from derain.errors import InputError
from derain.files.documents import Entry
from derain.files.packaged import packaged, packaged_or_own
from derain.simulation.defects import Defects
from derain.simulation.sensor import MOST_BEAMS, Pattern, ReturnMode, Sensor


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
    values = Entry.of_yaml(path).record(_PARSERS)
    try:
        return Sensor(**values)
    except InputError as error:
        raise InputError(
            path, f"{error.subject}: {error.reason}", "Take a packaged one as a pattern."
        ) from error


def _span(entry: Entry) -> tuple[float, ...]:
    return entry.numbers(2)


def _beams(entry: Entry) -> int:
    return entry.whole(1, MOST_BEAMS)


def _defects(entry: Entry) -> Defects:
    values = entry.record(dict.fromkeys(get_type_hints(Defects), Entry.number))
    try:
        return Defects(**values)
    except InputError as error:
        raise entry.fault(f"{error.subject}: {error.reason}", error.remedy) from error


# What reads the attributes of a sensor, by their type.
_PARSERS_BY_TYPE: dict[Any, Callable[[Entry], Any]] = {
    tuple[float, float]: _span,
    tuple[float, ...]: Entry.numbers,
    int: _beams,
    float: Entry.number,
    ReturnMode: Entry.text,
    Pattern: Entry.text,
    Defects: _defects,
}
_PARSERS = {name: _PARSERS_BY_TYPE[kind] for name, kind in get_type_hints(Sensor).items()}
