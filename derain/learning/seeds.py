"""Random generators of a training, from the run's seed, the epoch, and the kind of draw.

Every draw has a random generator of its own. So it does not matter how often others have drawn
before, in which process the draw is made, or whether the training was interrupted before it.
"""

import os
from enum import IntEnum

import numpy as np


class Draw(IntEnum):
    """The kinds of draws."""

    ORDER = 0
    AUGMENTATION = 1
    NETWORK = 2
    MIXTURE = 3


def run_seed() -> int:
    """Seed of the run: what Lightning's ``seed_everything`` was given, 0 where it was not."""
    return int(os.environ.get("PL_GLOBAL_SEED", 0))


def generator_of(draw: Draw, seed: int, epoch: int, *number: int) -> np.random.Generator:
    """The random generator of one draw.

    Args:
        draw: Kind of draw.
        seed: Seed of the run.
        epoch: The epoch, from 0.
        number: The number of the scan in the data, and which time it is drawn where that is not the
            first; the numbers of the step and of the process; or that of one of several data sets,
            whose passes are counted then in place of epochs.
    """
    # The numbers are the key, not part of the entropy: there, zeros at the end change nothing, so
    # that two draws could have the same generator.
    return np.random.default_rng(np.random.SeedSequence(seed, spawn_key=(draw, epoch, *number)))
