"""Damages files as a bad disk, a faulty program or an attacker would."""

import json
import math
import re
import struct
from collections.abc import Callable
from random import Random
from typing import Any

# What stands for a number where none was expected, or not that one.
EXTREMES = (-1, 0, 1, 255, 65_536, 10**9, 534_231_007, 2**31, 2**32 - 1, 2**63, 10**30)

_TEXTS = (
    *(str(number).encode() for number in EXTREMES),
    *(b"1e308", b"-1e999", b"nan", b"-inf", b"1.5", b"0x10", b"", b"9" * 5000),
)

# Where the words of a header are, if there is one.
_HEADER = 2000
_WORD = re.compile(rb"[-+.\w]+")
_NUMBER = re.compile(rb"(?<![\w.])[-+]?\d+(?:\.\d+)?(?![\w.])")


def damaged(content: bytes, other: bytes, generator: Random) -> bytes:
    """A file with one to three faults.

    Args:
        content: The file.
        other: Another file of the kind, to take pieces of.
        generator: What draws the faults at random.
    """
    for _ in range(generator.choice((1, 1, 1, 2, 3))):
        content = generator.choice(_FAULTS)(content, other, generator)
    return content


def changed(value: Any, generator: Random) -> Any:
    """A document with one to three of its values replaced, dropped, added or renamed.

    Args:
        value: What JSON knows: nested dicts and lists; it is not changed itself.
        generator: What draws the faults at random.
    """
    for _ in range(generator.choice((1, 1, 1, 2, 3))):
        value = _with_change(value, generator)
    return value


def as_json(value: Any) -> bytes:
    """A document as JSON, which is YAML as well unless a number in it is not finite."""
    return json.dumps(value, default=str).encode("utf-8", "surrogatepass")


def _flipped(content: bytes, other: bytes, generator: Random) -> bytes:
    changed_content = bytearray(content)
    for _ in range(generator.choice((1, 1, 2, 8)) if content else 0):
        changed_content[generator.randrange(len(content))] ^= 1 << generator.randrange(8)
    return bytes(changed_content)


def _truncated(content: bytes, other: bytes, generator: Random) -> bytes:
    return content[: generator.randrange(len(content) + 1)]


def _span(content: bytes, generator: Random) -> tuple[int, int]:
    start = generator.randrange(len(content) + 1)
    return start, min(len(content), start + generator.choice((1, 4, 16, 64, 1024)))


def _overwritten(content: bytes, other: bytes, generator: Random) -> bytes:
    start, end = _span(content, generator)
    return content[:start] + generator.randbytes(end - start) + content[end:]


def _duplicated(content: bytes, other: bytes, generator: Random) -> bytes:
    start, end = _span(content, generator)
    return content[:end] + content[start:end] * generator.choice((1, 1, 3, 100)) + content[end:]


def _deleted(content: bytes, other: bytes, generator: Random) -> bytes:
    start, end = _span(content, generator)
    return content[:start] + content[end:]


def _spliced(content: bytes, other: bytes, generator: Random) -> bytes:
    return _truncated(content, other, generator) + other[generator.randrange(len(other) + 1) :]


def _with_number(content: bytes, other: bytes, generator: Random) -> bytes:
    """One number of a text header replaced by an extreme one."""
    numbers = list(_NUMBER.finditer(content[:_HEADER]))
    if not numbers:
        return _with_packed_number(content, other, generator)
    start, end = generator.choice(numbers).span()
    return content[:start] + generator.choice(_TEXTS) + content[end:]


def _with_packed_number(content: bytes, other: bytes, generator: Random) -> bytes:
    """One number of a binary header replaced by an extreme one."""
    if len(content) < 8:
        return content
    kind = generator.choice(["<I", ">I", "<Q", "<f", "<d"])
    whole = kind[1] in "IQ"
    number = generator.choice(EXTREMES if whole else (math.nan, math.inf, 1e30))
    size = struct.calcsize(kind)
    packed = struct.pack(kind, number % 2 ** (8 * size) if whole else number)
    start = generator.randrange(min(len(content), _HEADER) - size + 1)
    return content[:start] + packed + content[start + size :]


def _with_word(content: bytes, other: bytes, generator: Random) -> bytes:
    """One word of a text header replaced by another of this or of another header."""
    words = list(_WORD.finditer(content[:_HEADER]))
    if not words:
        return content
    start, end = generator.choice(words).span()
    word = generator.choice(_WORD.findall(content[:_HEADER]) + _WORD.findall(other[:_HEADER]))
    return content[:start] + word + content[end:]


_FAULTS: tuple[Callable[[bytes, bytes, Random], bytes], ...] = (
    _flipped,
    _truncated,
    _overwritten,
    _duplicated,
    _deleted,
    _spliced,
    _with_number,
    _with_number,
    _with_packed_number,
    _with_word,
)


def _with_change(value: Any, generator: Random) -> Any:
    """Goes down from the root, and changes something where it ends."""
    if isinstance(value, dict) and value and generator.random() < 0.85:
        key = generator.choice(list(value))
        copy = dict(value)
        match generator.randrange(20):
            case 0:
                del copy[key]
            case 1:
                name = generator.choice(("", "x" * 5000, "spam", 5, "a\0b", "\ud800"))
                copy[name] = copy.pop(key)
            case 2:
                copy["spam"] = copy[key]
            case 3:
                copy[key] = generator.choice(list(value.values()))
            case _:
                copy[key] = _with_change(value[key], generator)
        return copy
    if isinstance(value, list) and value and generator.random() < 0.7:
        place = generator.randrange(len(value))
        parts = [_with_change(value[place], generator)] if generator.random() < 0.9 else []
        return [*value[:place], *parts, *value[place + 1 :]]
    return _odd_value(value, generator)


# Characters that a repeated value may take: repeated twice, it would take gigabytes to write down.
_MOST_REPEATED = 10**7


def _odd_value(value: Any, generator: Random) -> Any:
    nested: Any = value
    for _ in range(generator.choice((1, 5, 40, 80))):
        nested = generator.choice(([nested], {"a": nested}))
    return generator.choice(
        (
            generator.choice(EXTREMES),
            generator.choice((10**400, -(10**400), 0.5, -0.5, 1e308, -1e308, 1e-320)),
            generator.choice((math.nan, math.inf, -math.inf)),
            generator.choice((None, True, False)),
            generator.choice(("", "spam", "1", "nan", "x" * 20_000, "a\0b", "\ud800", "\x1b[31m")),
            generator.choice(([], {}, [[]], {"a": {}})),
            [value] * min(generator.choice((2, 100, 3000)), _MOST_REPEATED // len(repr(value)) + 1),
            nested,
        )
    )
