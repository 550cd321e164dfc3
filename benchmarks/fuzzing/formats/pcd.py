"""The Point Cloud Library's format (`.pcd`)."""

import struct
from collections.abc import Callable, Sequence

from benchmarks.fuzzing.format_inputs import BOMB, INPUTS, POINTS, FormatInputs, lines
from derain.evaluation.hard_cases import scene

_HEADER = """\
# .PCD v0.7 - Point Cloud Data file format
VERSION 0.7
FIELDS x y z intensity
SIZE 4 4 4 4
TYPE F F F F
COUNT 1 1 1 1
WIDTH {width}
HEIGHT {height}
VIEWPOINT 0 0 0 1 0 0 0
POINTS {points}
DATA {encoding}
"""


@INPUTS.add(".pcd")
class PcdInputs(FormatInputs):
    """PCD in its three encodings."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """A count of values that nobody has, and compressed data that unfold to gigabytes."""
        return (_of_many_values, _lzf_bomb)

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """Lines of text, an organised cloud, and compressed data."""
        return (
            _pcd("ascii", lines()),
            _pcd("binary", scene(POINTS).tobytes(), POINTS // 4, 4),
            _compressed(),
        )


def _pcd(encoding: str, data: bytes, width: int = POINTS, height: int = 1) -> bytes:
    header = _HEADER.format(width=width, height=height, points=width * height, encoding=encoding)
    return header.encode() + data


def _compressed() -> bytes:
    columns = scene(POINTS).T.tobytes()
    # LZF with nothing but literal runs of 32 bytes.
    runs = [columns[start : start + 32] for start in range(0, len(columns), 32)]
    packed = b"".join(bytes([len(run) - 1]) + run for run in runs)
    sizes = struct.pack("<II", len(packed), len(columns))
    return _pcd("binary_compressed", sizes + packed)


def _lzf_bomb() -> bytes:
    # A zero, then copies of the 264 bytes before.
    copies = BOMB * 10**6 // 264
    packed = b"\0\0" + b"\xe0\xff\0" * copies
    size = (1 + 264 * copies) // 16 * 16
    sizes = struct.pack("<II", len(packed), size)
    return _pcd("binary_compressed", sizes + packed, size // 16)


def _of_many_values() -> bytes:
    header = _HEADER.format(width=1, height=1, points=1, encoding="ascii")
    return header.replace("COUNT 1 1 1 1", "COUNT 1 1 1 534231007").encode() + b"1 2 3 4\n"
