"""Settings that documents state: read by their types, and refused where they are impossible."""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass, fields, replace
from numbers import Real
from typing import Annotated, Any, ClassVar, Literal, Self, get_args, get_origin

from derain.errors import InputError
from derain.files.documents import Entry, shown
from derain.simulation.drawing import Span

# What reads a value of a document.
Parser = Callable[[Entry], Any]

# No setting counts more than this.
MOST = 2**31


@dataclass(frozen=True)
class Within:
    """The rule of numbers from ``least`` to ``most``."""

    least: float
    most: float

    def __call__(self, value: float) -> bool:
        """True for such a number."""
        return self.least <= value <= self.most


# Types of settings, each with the rule that its values follow: shares, finite numbers above 0, and
# spans above 0, from which a number can be drawn evenly in its logarithm.
Share = Annotated[float, Within(0, 1)]
Positive = Annotated[float, lambda value: 0 < value < math.inf]
LogSpan = Annotated[Span, lambda span: 0 < span[0] <= span[1] < math.inf]


def weights_of(*names: str) -> Parser:
    """Reads a weight for each of some known names."""
    return lambda entry: entry.record(dict.fromkeys(names, Entry.number))


@dataclass(frozen=True)
class Settings:
    """The base of frozen settings; a document states those that differ from the defaults.

    Attributes:
        SUBJECT: Name of the settings in messages.
        READ_BY: Parsers of attributes that are not parsed by type, by name.

    Raises:
        InputError: A value that is impossible. It names the first such attribute.
    """

    SUBJECT: ClassVar[str]
    READ_BY: ClassVar[Mapping[str, Parser]] = {}

    def __post_init__(self) -> None:
        special = self._possible()
        for one in fields(self):
            value = getattr(self, one.name)
            if not special.get(one.name, _is_possible(value, one.type)):
                reason = f"{shown(value)} is impossible"
                match get_args(one.type):
                    case (_, Within(least, most)):
                        remedy = f"Give {least:,.7g} to {most:,.7g}."
                    case _:
                        remedy = "Correct it."
                raise InputError(f"{self.SUBJECT}: {one.name}", reason, remedy)

    def _possible(self) -> Mapping[str, bool]:
        """Validity of attributes, by name, for conditions beyond their types."""
        return {}

    @classmethod
    def of(cls, entry: Entry) -> Self:
        """Reads settings from a document; those that it leaves out have their defaults.

        Raises:
            InputError: Another key, or a value of another kind or that is impossible.
        """
        return cls().changed(entry)

    def changed(self, entry: Entry) -> Self:
        """The settings with the changes stated in a document; errors as for :meth:`of`."""
        parsers = {
            one.name: self.READ_BY.get(one.name) or _parser(one.type) for one in fields(self)
        }
        values = entry.record(parsers)
        try:
            return replace(self, **values)
        except InputError as error:
            raise entry.fault(f"{error.subject}: {error.reason}", error.remedy) from error


def _is_possible(value: Any, kind: Any) -> bool:
    """True if a value is possible by its type.

    Of a type without a rule, numbers are finite from 0 on, spans finite and ascending, and weights
    finite from 0 on with some of them above.
    """
    if get_origin(kind) is Literal:
        return value in get_args(kind)
    if get_origin(kind) is Annotated:
        is_possible: Callable[[Any], bool] = get_args(kind)[1]
        return is_possible(value)
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
    """The function that parses a value of a type."""
    if get_origin(kind) is Literal:
        return Entry.text
    if get_origin(kind) is Annotated:
        return _parser(get_args(kind)[0])
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
