"""Types of command line arguments: what cannot be meant is refused before any work."""

import argparse
import math


def count(text: str) -> int:
    """A whole number of 1 or more."""
    return _at_least(1, text)


def threads(text: str) -> int:
    """A number of threads; 0 stands for every core."""
    return _at_least(0, text)


def factor(text: str) -> float:
    """A finite number above 0."""
    value = float(text)
    if not (value > 0 and math.isfinite(value)):
        raise argparse.ArgumentTypeError(f"{text} is not a number above 0")
    return value


def _at_least(least: int, text: str) -> int:
    value = int(text)
    if value < least:
        raise argparse.ArgumentTypeError(f"{text} is less than {least}")
    return value
