"""The colours of scans in pictures, windows and the viewer; it needs no drawing library."""

import numpy as np
from numpy.typing import NDArray

from derain.scan import Bools, Ints

# Bright on dark, and distinct to colour-blind eyes.
BACKGROUND = "#10151c"
SOLID = "#7d8a99"
RAIN = "#39c5ff"
MISSED = "#ffd23f"
LOST = "#ff5d5d"

# Colours by the class of a point and its outcome; outcomes are numbers in this order.
OUTCOMES = {"solid, kept": SOLID, "rain, removed": RAIN, "rain, left": MISSED, "solid, lost": LOST}

# The same where the rain is not known.
WITHOUT_LABELS = {"kept": SOLID, "removed": RAIN}

# Probabilities from 0 to 1: dark, the colour of rain, white.
PROBABILITY = ("#2b3440", RAIN, "#ffffff")

# Lines of several methods in one plot, distinct to colour-blind eyes; reused after the last.
# Source: M. Okabe and K. Ito, "Color Universal Design", 2008; without its black and yellow, which
# do not show on dark and on light ground alike.
LINES = ("#56b4e9", "#e69f00", "#009e73", "#cc79a7", "#0072b2", "#d55e00")


def outcomes(predicted: Bools, rain: Bools) -> Ints:
    """Outcome of each point as a number of ``OUTCOMES``, int64 (N,).

    Args:
        predicted: Points called rain, bool (N,).
        rain: Points that are rain, bool (N,).
    """
    return np.select([rain & predicted, rain & ~predicted, predicted], [1, 2, 3], default=0)


def rgb(colour: str) -> tuple[int, int, int]:
    """Red, green and blue, 0 to 255, of a colour such as ``#39c5ff``."""
    red, green, blue = bytes.fromhex(colour.removeprefix("#"))
    return red, green, blue


def shades(colours: tuple[str, ...], share: NDArray[np.floating]) -> NDArray[np.uint8]:
    """Interpolates colours, uint8 (N, 3).

    Args:
        colours: Two or more, evenly spaced from 0 to 1.
        share: Position of each point from 0 to 1, (N,); values beyond are clipped.
    """
    places = np.linspace(0, 1, len(colours))
    table = np.array([rgb(colour) for colour in colours])
    channels = [np.interp(share, places, channel) for channel in table.T]
    return np.stack(channels, axis=-1).round().astype(np.uint8)
