"""Arrow's tables (`.feather`)."""

import struct
from collections.abc import Callable, Sequence

import numpy as np

from benchmarks.fuzzing.format_inputs import BOMB, INPUTS, FormatInputs

# Rows of a table of zeros, and the bytes of each of its columns.
_ROWS, _COLUMN = 1000, 4000


@INPUTS.add(".feather")
class FeatherInputs(FormatInputs):
    """Tables, compressed in two ways."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """Compressed columns that state gigabytes."""
        return (lambda: _bomb("lz4"), lambda: _bomb("zstd"))


def _bomb(compression: str) -> bytes:
    import pyarrow
    from pyarrow import feather

    zeros = np.zeros(_ROWS, np.float32)
    sink = pyarrow.BufferOutputStream()
    table = pyarrow.table(dict.fromkeys(("x", "y", "z", "intensity"), zeros))
    feather.write_feather(table, sink, compression)
    stated = struct.pack("<q", _COLUMN)
    assert stated in bytes(sink.getvalue())
    return bytes(sink.getvalue()).replace(stated, struct.pack("<q", BOMB * 10**6))
