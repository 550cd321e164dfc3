"""Settings that documents state: read by their types, and refused where they are impossible."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Any, ClassVar, Literal, Self, get_origin

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.simulation.drawing import Span

# What reads a value of a document.
Parser = Callable[[Entry], Any]

# No setting counts more than this.
MOST = 2**31


def weights_of(*names: str) -> Parser:
    """Reads a weight for each of some known names."""
    return lambda entry: entry.record(dict.fromkeys(names, Entry.number))


@dataclass(frozen=True)
class Settings:
    """The base of frozen settings, of which a document states those that differ.

    Attributes:
        READ_BY: What reads the attributes that are not read by their types, by name.
    """

    READ_BY: ClassVar[Mapping[str, Parser]] = {}

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Reads settings from a document; those that it leaves out have their defaults.

        Raises:
            InputError: Another key, or a value of another kind or that is impossible.
        """
        return cls().changed(entry)

    def changed(self, entry: Entry) -> Self:
        """The same settings but for those that a document states; errors as for :meth:`of`."""
        parsers = {
            one.name: self.READ_BY.get(one.name) or _parser(one.type) for one in fields(self)
        }
        values = entry.record(parsers)
        try:
            return replace(self, **values)
        except InputError as error:
            raise entry.fault(f"{error.subject}: {error.reason}", error.remedy) from error

    def _refuse_impossible(self, subject: str, possible: Mapping[str, bool]) -> None:
        """Refuses the first setting that is impossible.

        Args:
            subject: What messages call the settings.
            possible: Whether a setting is possible, by name. Of those that are not named numbers
                must be finite from 0 on, spans finite and ascending, weights from 0 on and some of
                them above.

        Raises:
            InputError: It names the setting.
        """
        for one in fields(self):
            value = getattr(self, one.name)
            if not possible.get(one.name, _is_usual(value)):
                reason = f"{shown(value)} is impossible"
                raise InputError(f"{subject}: {one.name}", reason, "Correct it.")


def _is_usual(value: Any) -> bool:
    match value:
        case Real():
            return 0 <= float(value) < math.inf
        case (low, high):
            return bool(low <= high and math.isfinite(high - low))
        case Mapping():
            weights = value.values()
            return all(0 <= weight < math.inf for weight in weights) and any(weights)
    return True


def _parser(kind: Any) -> Parser:
    """What reads a value of a type."""
    if get_origin(kind) is Literal:
        return Entry.text
    if kind in _PARSERS:
        return _PARSERS[kind]
    read: Parser = kind.of
    return read


_PARSERS: dict[Any, Parser] = {
    int: lambda entry: entry.whole(1, MOST),
    float: Entry.number,
    Span: lambda entry: entry.numbers(2),
    tuple[float, ...]: Entry.numbers,
    tuple[int, ...]: lambda entry: tuple(item.whole(1, MOST) for item in entry.items()),
}
