"""Laser surveys (`.las`, `.laz`)."""

import io
import struct
from collections.abc import Callable, Sequence
from functools import partial

import numpy as np

from benchmarks.fuzzing.format_inputs import INPUTS, POINTS, FormatInputs
from derain.evaluation.hard_cases import scene

# Where the header says how many records follow it, and how many points: LAS 1.4 R15, table 3.
_RECORDS, _POINTS = 100, 247


@INPUTS.add(".las", ".laz")
class LasInputs(FormatInputs):
    """Surveys of two versions."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """Counts of points, records, chunks and layers that no file can hold."""
        counts = (
            partial(_with, _POINTS, struct.pack("<Q", 2**40), suffix),
            partial(_with, _RECORDS, b"\xff\xff\xff\xff", suffix),
        )
        return (*counts, _of_many_chunks, _of_a_long_layer) if suffix == ".laz" else counts

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """As laspy writes them."""
        return [_las(suffix, version) for version in ("1.2", "1.4")]


def _las(suffix: str, version: str) -> bytes:
    import laspy

    header = laspy.LasHeader(version=version, point_format=7 if version == "1.4" else 3)
    header.offsets, header.scales = np.array([4e5, 5e6, 0]), np.full(3, 0.001)
    las = laspy.LasData(header)
    points = scene(POINTS)
    las.xyz = points[:, :3] + header.offsets
    las.intensity = points[:, 3].astype(np.uint16)
    file = io.BytesIO()
    las.write(file, do_compress=suffix == ".laz")
    return file.getvalue()


def _with(place: int, value: bytes, suffix: str) -> bytes:
    content = _las(suffix, "1.4")
    return content[:place] + value + content[place + len(value) :]


def _of_many_chunks() -> bytes:
    _, table = _chunks()
    return _with(table + 4, b"\xf0\xff\xff\xff", ".laz")


def _of_a_long_layer() -> bytes:
    begin, _ = _chunks()
    # Behind the place of the table are the first point, of 36 bytes, and the number of points.
    return _with(begin + 8 + 36 + 4, b"\xf0\xff\xff\xff", ".laz")


def _chunks() -> tuple[int, int]:
    """Where the compressed points begin, and where their table of chunks does."""
    content = _las(".laz", "1.4")
    (begin,) = struct.unpack_from("<I", content, 96)
    (table,) = struct.unpack_from("<q", content, begin)
    return begin, table
