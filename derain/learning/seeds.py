"""Where the randomness of a training comes from: the run's seed, the epoch, and what is drawn.

Whatever draws has a generator of its own for every draw, so that how many others have drawn before,
in which process, or before which interruption does not matter.
"""

import os
from enum import IntEnum

import numpy as np


class Draw(IntEnum):
    """What is drawn."""

    ORDER = 0
    AUGMENTATION = 1
    NETWORK = 2


def run_seed() -> int:
    """Seed of the run: what Lightning's ``seed_everything`` was given, 0 where it was not."""
    return int(os.environ.get("PL_GLOBAL_SEED", 0))


def generator(draw: Draw, seed: int, epoch: int, *number: int) -> np.random.Generator:
    """The generator of one draw.

    Args:
        draw: What is drawn.
        seed: Seed of the run.
        epoch: The epoch, from 0.
        number: For which scan of the data, or at which step and in which process.
    """
    # The numbers are a key of their own: in the entropy itself, zeros at the end change nothing.
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(draw, epoch, *number)))
