"""Which numbers of many are equal, without sorting them."""

import numpy as np
from numpy.typing import NDArray

# Multipliers of the hash: an odd number whose product mixes every bit into the upper ones, and what
# makes another one of it for the next round.
# Sources: Knuth, "The Art of Computer Programming", volume 3, 6.4 (2³² over the golden ratio);
# Steele and Vigna 2021, "Computationally easy, spectrally good multipliers".
MULTIPLIER, NEXT_MULTIPLIER = 2654435769, 0x915F77F5

# A sample has one in so many values, and speaks for all of them if it has so many numbers.
ONE_IN, FEWEST_SAMPLED = 16, 3000


def repetitions(numbers: NDArray[np.uint32]) -> tuple[NDArray[np.intp], NDArray[np.intp]]:
    """Finds the numbers that repeat another one.

    Every place is written into the slot of a table that the hash of its number names, the later
    ones over the earlier ones. Whoever finds another place there repeats its number, or else only
    shares a slot with it: then so do all that equal it, and they are asked again among themselves,
    with another hash. Few are, while a sort, which takes five times as long, moves all.

    Args:
        numbers: uint32 (N,).

    Returns:
        Places of which the numbers are those at other places, (R,), in no order; and these, (R,).
        None of these is in the first, so that leaving the first out leaves each number once.
    """
    table = np.empty(1 << max(2 * len(numbers), 2).bit_length(), np.int32)
    multiplier, asked = MULTIPLIER, numbers
    places = np.arange(len(numbers), dtype=np.int32)
    pairs = [(places[:0], places[:0])]
    while len(asked):
        found = _last_in_slot(asked, places, multiplier, table)
        equal = numbers.take(found) == asked
        # take is several times faster than indexing by truth values that follow no pattern.
        repeats, strangers = np.flatnonzero(equal & (found != places)), np.flatnonzero(~equal)
        pairs.append((places.take(repeats), found.take(repeats)))
        places, asked = places.take(strangers), asked.take(strangers)
        multiplier = multiplier * NEXT_MULTIPLIER % 2**32
    repeating, repeated = (
        np.concatenate(parts, dtype=np.intp) for parts in zip(*pairs, strict=True)
    )
    return repeating, repeated


def seem_distinct(numbers: NDArray[np.uint32]) -> bool:
    """Whether a sample shows that next to none of the numbers repeats another.

    The sample is of values, not of places, so that it has all that equal one of it. Of few numbers
    the answer is no.

    Args:
        numbers: uint32 (N,).

    Returns:
        Whether the sample has no repetition, and is so large that, with one chance in twenty of an
        error, no more than three in FEWEST_SAMPLED of the values are repeated.

    Source: Hanley and Lippman-Hand 1983, the rule of three.
    """
    sampled = np.flatnonzero(numbers * np.uint32(NEXT_MULTIPLIER) < 2**32 // ONE_IN)
    return len(sampled) >= FEWEST_SAMPLED and not len(repetitions(numbers.take(sampled))[0])


def _last_in_slot(
    numbers: NDArray[np.uint32],
    places: NDArray[np.int32],
    multiplier: int,
    table: NDArray[np.int32],
) -> NDArray[np.int32]:
    """The place that stands in the slot of each number, after all have written theirs there."""
    lower = np.uint32(33 - len(table).bit_length())
    slot = (numbers * np.uint32(multiplier) >> lower).astype(np.intp)
    table[slot] = places  # only slots that were written to are read, so that it needs no zeros
    return table.take(slot)
