"""What the fuzzer gives a format of scan files besides what derain writes in it."""

import io
import zlib
from abc import ABC, abstractmethod
from collections.abc import Callable, Sequence
from random import Random

import numpy as np

from derain.evaluation.hard_cases import scene
from derain.system.registry import Registry

# Points of every scan that is to be damaged.
POINTS = 40

# What a bomb unfolds to, MB: more than a reader may take.
BOMB = 1500


class FormatInputs(ABC):
    """What one format is given, by its suffixes: ``@INPUTS.add(".pcd")``."""

    @abstractmethod
    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """What makes each of the files that somebody thought out to stop or fill a process.

        Args:
            suffix: The format's, where it has several.
        """

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """Sound files such as other programs write."""
        return ()

    def own_damage(self) -> Callable[[Random], bytes] | None:
        """What makes a damaged file by what is known of the format; None where nothing is."""
        return None


INPUTS: Registry[type[FormatInputs]] = Registry("benchmarks.fuzzing.formats")


def lines() -> bytes:
    """The points of a scan as lines of text: x, y, z and intensity."""
    file = io.BytesIO()
    np.savetxt(file, scene(POINTS), "%.6g")
    return file.getvalue()


def npy(array: "np.typing.ArrayLike") -> bytes:
    """An array as NumPy saves it."""
    file = io.BytesIO()
    np.save(file, np.asarray(array))
    return file.getvalue()


def deflated_zeros(start: bytes) -> bytes:
    """Raw deflated data that unfold to a start and then to zeros, by the same block repeated."""
    packer = zlib.compressobj(9, zlib.DEFLATED, -15)
    head = packer.compress(start) + packer.flush(zlib.Z_FULL_FLUSH)
    block = packer.compress(bytes(10**6)) + packer.flush(zlib.Z_FULL_FLUSH)
    return head + block * BOMB + packer.flush()
