"""A value of a YAML file that knows where it stands, so that what is wrong with it can be said."""

import math
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import yaml

from derain.errors import InputError
from derain.files.reading import reading


@dataclass(frozen=True)
class Entry:
    """A value of a YAML file.

    Every method raises InputError for a value of another kind than it reads; the message has the
    file and the key.

    Attributes:
        file: The file.
        key: Keys that lead to the value, joined by dots; empty for the whole file.
        value: What stands there.
    """

    file: Path
    key: str
    value: Any

    @classmethod
    def of_file(cls, path: Path) -> "Entry":
        """The whole of a file."""
        with reading(path, yaml.YAMLError, UnicodeDecodeError):
            return cls(path, "", yaml.safe_load(path.read_text("utf-8")))

    def fault(self, reason: str, remedy: str) -> InputError:
        """The error that says what is wrong here."""
        return InputError(f"{self.file}: {self.key}" if self.key else self.file, reason, remedy)

    def members(self) -> dict[str, "Entry"]:
        """The values of a mapping by their keys, which must be text."""
        if not isinstance(self.value, dict):
            raise self.fault(f"{self.value!r} is not a mapping", "Write `key: value` pairs.")
        for key in self.value:
            if not isinstance(key, str):
                raise self.fault(f"the key {key!r} is no text", "Quote it: 010 alone is a number.")
        return {
            key: Entry(self.file, f"{self.key}.{key}" if self.key else key, value)
            for key, value in self.value.items()
        }

    def record(
        self, parsers: Mapping[str, Callable[["Entry"], Any]], required: Collection[str] = ()
    ) -> dict[str, Any]:
        """What is in a mapping whose keys are known.

        Args:
            parsers: What reads the value, by key.
            required: Keys that may not be missing.
        """
        members = self.members()
        for key, entry in members.items():
            if key not in parsers:
                raise entry.fault("there is no such key", f"Known are {', '.join(parsers)}.")
        for key in required:
            if key not in members:
                raise self.fault(f"{key} is missing", "Add it.")
        return {key: parsers[key](entry) for key, entry in members.items()}

    def items(self) -> list["Entry"]:
        """The values of a list."""
        if not isinstance(self.value, list):
            raise self.fault(f"{self.value!r} is not a list", "Write [values, in, brackets].")
        return [
            Entry(self.file, f"{self.key}[{number}]", value)
            for number, value in enumerate(self.value)
        ]

    def numbers(self, count: int) -> tuple[float, ...]:
        """A list of so many finite numbers."""
        items = self.items()
        if len(items) != count:
            raise self.fault(f"{self.value!r} are not {count} numbers", f"Write {count}.")
        return tuple(item.number() for item in items)

    def number(self) -> float:
        """A finite number."""
        # Not isinstance: to Python, true and false are numbers.
        if type(self.value) not in (int, float) or not math.isfinite(self.value):
            raise self.fault(f"{self.value!r} is not a finite number", "Write one number.")
        return float(self.value)

    def positive(self) -> float:
        """A finite number above 0."""
        number = self.number()
        if number <= 0:
            raise self.fault(f"{number:g} is not above 0", "Write one that is.")
        return number

    def whole(self, least: int, most: int) -> int:
        """A whole number from ``least`` to ``most``."""
        if type(self.value) is not int or not least <= self.value <= most:
            raise self.fault(
                f"{self.value!r} is not a whole number from {least:,} to {most:,}",
                "Write one that is.",
            )
        return self.value
