"""Small YAML and JSON documents from users and models, read within bounds.

Nothing in them is trusted: a document may be large, deeply nested or full of aliases that stand for
one another, and every value may be of another kind than it should be.
"""

import json
import math
import re
import reprlib
from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass
from importlib import resources
from pathlib import Path
from typing import Any, TypeVar

import yaml

from derain.errors import InputError, did_you_mean
from derain.files.reading import is_file, read_bytes, reading

# Far more than any card, scene or Spec takes, and read in a second.
LARGEST_DOCUMENT = 2**20

# The deepest document of derain, a Spec in a checkpoint's proof, has five levels.
DEEPEST = 32

# A value takes up to a hundred times more memory than the two characters that may stand for it.
# The number of values is therefore limited to one for each of these bytes of the largest document.
BYTES_PER_VALUE = 16

# Errors of PyYAML on bad documents: its own, and those of Python, for instance where a tag such as
# !!int stands before a text.
_YAML_DAMAGE = (
    *(yaml.YAMLError, ValueError, LookupError, TypeError, AttributeError),
    *(ArithmeticError, RecursionError),
)

# The parser in C where PyYAML was built with it: ten times faster on a large document.
_SAFE_LOADER: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)


class _Loader(_SAFE_LOADER):  # type: ignore[misc]
    """Refuses a mapping with a key twice; YAML's own loader takes the last."""

    def construct_mapping(self, node: yaml.MappingNode, deep: bool = False) -> Any:
        keys = set()
        for key_node, _ in node.value:
            if not isinstance(key_node, yaml.ScalarNode):
                continue
            key = self.construct_object(key_node)
            if key in keys:
                line = key_node.start_mark.line + 1
                raise ValueError(f"line {line:,}: the key {shown(key)} is there twice")
            keys.add(key)
        return super().construct_mapping(node, deep)


# A number with an exponent, such as 4e-6, which PyYAML takes for a text.
# Source: YAML 1.2.2, section 10.3.2, core schema.
_Loader.add_implicit_resolver(
    "tag:yaml.org,2002:float",
    re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)[eE][-+]?[0-9]+$"),
    list("-+.0123456789"),
)

Parsed = TypeVar("Parsed")


class _Short(reprlib.Repr):
    """Shortens long values; Python refuses to print whole numbers of thousands of digits."""

    def repr_int(self, x: int, level: int) -> str:
        return super().repr_int(x, level) if x.bit_length() < 10_000 else "a number of many digits"


_SHORT = _Short()
_SHORT.maxlevel, _SHORT.maxstring, _SHORT.maxother = 2, 60, 60


@dataclass(frozen=True)
class Entry:
    """A value of a document with its place, so that an error can name it.

    Every method raises InputError for a value of another kind than it reads; the message has the
    document and the key.

    Attributes:
        source: The file, or other container of the document.
        key: Keys that lead to the value, joined by dots; empty for the whole document.
        value: The value.
    """

    source: Path | str
    key: str
    value: Any

    @classmethod
    def of_yaml(cls, path: Path, largest: int = LARGEST_DOCUMENT) -> "Entry":
        """The whole of a YAML file.

        Args:
            path: The file.
            largest: Bytes that it may have.

        Raises:
            InputError: A file that cannot be read, is too large or nested too deeply, uses aliases,
                or is not YAML.
        """
        with reading(path, *_YAML_DAMAGE):
            return cls(path, "", parsed_yaml(read_bytes(path, largest).decode("utf-8"), largest))

    @classmethod
    def of_json_file(cls, path: Path, largest: int = LARGEST_DOCUMENT) -> "Entry":
        """The whole of a JSON file; arguments and errors as for :meth:`of_yaml`."""
        with reading(path, ValueError):
            text = read_bytes(path, largest).decode("utf-8")
        return cls.of_json(text, path, largest)

    @classmethod
    def of_json(cls, text: str, source: Path | str, largest: int = LARGEST_DOCUMENT) -> "Entry":
        """Reads a JSON document inside another file, such as the metadata of a model.

        Args:
            text: The document.
            source: The surrounding file, for messages.
            largest: Characters that it may have.

        Raises:
            InputError: A text that is too large or nested too deeply, or is not JSON.
        """
        try:
            if len(text) > largest:
                raise ValueError(f"{len(text):,} characters")
            # At least as many as there are values: what stands in texts counts as well.
            if sum(map(text.count, ",:[{")) > largest // BYTES_PER_VALUE:
                raise ValueError(f"more than {largest // BYTES_PER_VALUE:,} values")
            value = json.loads(text)
            _refuse_depth(value)
        except (ValueError, RecursionError) as error:
            raise InputError(source, f"not JSON ({error})", "Write it again.") from error
        return cls(source, "", value)

    def fault(self, reason: str, remedy: str) -> InputError:
        """The error of a wrong value here."""
        place = f"{self.source}: {short(self.key)}" if self.key else self.source
        return InputError(place, reason, remedy)

    def members(self) -> dict[str, "Entry"]:
        """The values of a mapping by their keys, which must be text."""
        if self.value is None and not self.key:
            raise self.fault("it is empty", "Write `key: value` pairs.")
        if not isinstance(self.value, dict):
            raise self.fault(f"{shown(self.value)} is not a mapping", "Write `key: value` pairs.")
        for key in self.value:
            if not isinstance(key, str):
                reason = f"the key {shown(key)} is no text"
                raise self.fault(reason, "Quote it: 010 alone is a number.")
        return {
            key: Entry(self.source, f"{self.key}.{key}" if self.key else key, value)
            for key, value in self.value.items()
        }

    def each(self, read: Callable[["Entry"], Parsed]) -> dict[str, Parsed]:
        """Parses each value of a mapping; returns the results by key."""
        return {key: read(entry) for key, entry in self.members().items()}

    def texts_by_number(self, most: int) -> dict[int, str]:
        """Texts by the keys of a mapping: whole numbers from 0 to ``most``, in JSON as texts."""
        if not isinstance(self.value, dict):
            raise self.fault(f"{shown(self.value)} is not a mapping", "Write `0: text` pairs.")
        return {
            Entry(self.source, self.key, _as_number(key)).whole(0, most): Entry(
                self.source, f"{self.key}.{shown(key)}", value
            ).text()
            for key, value in self.value.items()
        }

    def record(
        self, parsers: Mapping[str, Callable[["Entry"], Any]], required: Collection[str] = ()
    ) -> dict[str, Any]:
        """Parses a mapping with known keys.

        Args:
            parsers: Parser of the value, by key.
            required: Keys that may not be missing.
        """
        members = self.members()
        for key, entry in members.items():
            if key not in parsers:
                remedy = f"{did_you_mean(key, parsers)}Available: {', '.join(parsers)}."
                raise entry.fault("there is no such key", remedy)
        for key in required:
            if key not in members:
                raise self.fault(f"{key} is missing", "Add it.")
        return {key: parsers[key](entry) for key, entry in members.items()}

    def items(self) -> list["Entry"]:
        """The values of a list."""
        if not isinstance(self.value, list):
            raise self.fault(f"{shown(self.value)} is not a list", "Write [values, in, brackets].")
        return [
            Entry(self.source, f"{self.key}[{number}]", value)
            for number, value in enumerate(self.value)
        ]

    def numbers(
        self, count: int | None = None, read: Callable[["Entry"], float] | None = None
    ) -> tuple[float, ...]:
        """A list of finite numbers, of a given length or of any.

        Args:
            count: Length of the list; None allows any.
            read: Parser of each of them, such as ``Entry.positive``; by default ``Entry.number``.
        """
        items = self.items()
        if count is not None and len(items) != count:
            raise self.fault(f"{shown(self.value)} are not {count} numbers", f"Write {count}.")
        return tuple(map(read or Entry.number, items))

    def number(self) -> float:
        """A finite number."""
        # Not isinstance: to Python, true and false are numbers. A whole number may have more digits
        # than a float can hold.
        if type(self.value) not in (int, float) or not -math.inf < self.value < math.inf:
            raise self.fault(f"{shown(self.value)} is not a finite number", "Write one number.")
        try:
            return float(self.value)
        except OverflowError:
            raise self.fault("the number is too large", "Write one number.") from None

    def positive(self) -> float:
        """A finite number above 0."""
        number = self.number()
        if number <= 0:
            raise self.fault(f"{number:g} is not above 0", "Write one that is.")
        return number

    def within(self, least: float, most: float) -> float:
        """A number from ``least`` to ``most``."""
        number = self.number()
        if not least <= number <= most:
            reason = f"{number:g} is not within {least:g} and {most:g}"
            raise self.fault(reason, "Write one that is.")
        return number

    def whole(self, least: int, most: int) -> int:
        """A whole number from ``least`` to ``most``."""
        if type(self.value) is not int or not least <= self.value <= most:
            reason = f"{shown(self.value)} is not a whole number from {least:,} to {most:,}"
            raise self.fault(reason, "Write one that is.")
        return self.value

    def truth(self) -> bool:
        """True or false."""
        if not isinstance(self.value, bool):
            raise self.fault(f"{shown(self.value)} is neither true nor false", "Write one of them.")
        return self.value

    def text(self) -> str:
        """A text, which may be the name of a file."""
        if not isinstance(self.value, str):
            raise self.fault(f"{shown(self.value)} is no text", "Put it in quotes.")
        if "\0" in self.value:
            raise self.fault("it has a null character", "Leave it out.")
        return self.value

    def one_of(self, choices: Collection[Parsed]) -> Parsed:
        """One of some known texts."""
        for choice in choices:
            if choice == self.value:
                return choice
        reason = f"{shown(self.value)} is not known"
        raise self.fault(reason, f"Available: {', '.join(map(str, choices))}.")

    def texts(self) -> tuple[str, ...]:
        """A list of texts."""
        return tuple(item.text() for item in self.items())

    def scalar(self) -> str | bool | int | float:
        """A text, a finite number, or true or false."""
        if isinstance(self.value, str):
            return self.text()
        if isinstance(self.value, bool):
            return self.value
        number = self.number()
        return self.value if isinstance(self.value, int) else number


def shown(value: Any) -> str:
    """A value for a message, shortened if it is long."""
    return _SHORT.repr(value)


def short(text: str) -> str:
    """A text for a message, without quotes and shortened if it is long."""
    return text if len(text) <= 60 else f"{text[:57]}..."


def _as_number(key: Any) -> Any:
    """The number that a key of JSON stands for; any other key as it is."""
    is_number = isinstance(key, str) and len(key) <= 9 and key.isascii() and key.isdecimal()
    return int(key) if is_number else key


def _refuse_depth(value: Any, depth: int = 0) -> None:
    if depth > DEEPEST:
        raise ValueError(f"nested more than {DEEPEST} deep")
    if isinstance(value, dict | list):
        for part in value.values() if isinstance(value, dict) else value:
            _refuse_depth(part, depth + 1)


def parsed_yaml(text: str, largest: int = LARGEST_DOCUMENT, aliases: bool = False) -> Any:
    """The value of a text in YAML.

    Args:
        text: The text.
        largest: Characters that it may have.
        aliases: True if it may use aliases, as programs write them; whoever goes through all of it
            may then find far more than was written.

    Raises:
        Exception: Whatever PyYAML raises; ValueError for one that is too large or nested too
            deeply, or uses aliases.
    """
    if len(text) > largest:
        raise ValueError(f"more than {largest:,} characters")
    # Before any values are made, which may take far more memory than the text.
    depth, most = 0, largest // BYTES_PER_VALUE
    for number, event in enumerate(yaml.parse(text, _Loader)):
        if number > most:
            raise ValueError(f"more than {most:,} values")
        if isinstance(event, yaml.AliasEvent) and not aliases:
            raise ValueError(f"the alias *{short(str(event.anchor))}: write out what it stands for")
        depth += isinstance(event, yaml.CollectionStartEvent)
        depth -= isinstance(event, yaml.CollectionEndEvent)
        if depth > DEEPEST:
            raise ValueError(f"nested more than {DEEPEST} deep")
    return yaml.load(text, _Loader)


def packaged(package: str, folder: str = "") -> dict[str, Path]:
    """The YAML files of a package, by name, sorted: each is found by being there.

    Args:
        package: Name of the package, such as ``derain.cards``.
        folder: Folder within it, where they do not lie beside the package's modules.
    """
    files = Path(str(resources.files(package))) / folder
    return {file.stem: file for file in sorted(files.glob("*.yaml"))}


def packaged_or_own(name: str | Path, files: Mapping[str, Path], kind: str) -> Path:
    """The file that a user names.

    Args:
        name: Name of a packaged file, or the path of one of the user's own.
        files: The packaged ones, by name.
        kind: Kind of document, such as "sensor", for the message.

    Raises:
        InputError: There is no such file.
    """
    path = files.get(str(name), Path(name))
    if not is_file(path):
        remedy = f"{did_you_mean(name, files)}Give a YAML file or one of {', '.join(files)}."
        raise InputError(name, f"no such {kind}", remedy)
    return path
