"""Rows of numbers without a header (`.bin`)."""

from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.fuzzing.format_inputs import INPUTS, POINTS, FormatInputs
from derain.evaluation.hard_cases import scene


@INPUTS.add(".bin")
class BinaryInputs(FormatInputs):
    """Rows of float32 or float64."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """Numbers that overflow when they are squared, none at all, and half of a row."""
        return (
            np.full((POINTS, 4), np.finfo(np.float32).max).tobytes,
            np.full((POINTS, 4), np.nan, np.float32).tobytes,
            np.full((POINTS, 4), np.finfo(np.float64).max).tobytes,
            lambda: bytes(16 * POINTS + 8),
        )

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """As KITTI's."""
        return (scene(POINTS).tobytes(),)
