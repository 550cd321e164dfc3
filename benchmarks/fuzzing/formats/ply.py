"""The polygon file format (`.ply`)."""

import struct
from collections.abc import Callable, Sequence

from benchmarks.fuzzing.format_inputs import INPUTS, POINTS, FormatInputs, lines
from derain.evaluation.hard_cases import scene

ENCODINGS = ("ascii", "binary_little_endian", "binary_big_endian")


@INPUTS.add(".ply")
class PlyInputs(FormatInputs):
    """PLY in its three encodings, with and without faces."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """More vertices than a file can hold, and a face of as many."""
        return (
            lambda: _header("ascii", 10**18, 0) + b"1 2 3 4\n",
            lambda: _header("binary_big_endian", 10**18, 0) + bytes(16),
            # One vertex, and faces of which the first says that it has two billion.
            lambda: _header("binary_little_endian", 1, 10**18) + bytes(16) + b"\xff\xff\xff\x7f",
        )

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """Clouds and meshes."""
        return [_ply(encoding, faces) for encoding in ENCODINGS for faces in (0, 2)]


def _header(encoding: str, points: int, faces: int, length: str = "uint") -> bytes:
    header = [
        "ply",
        f"format {encoding} 1.0",
        f"element vertex {points}",
        *(f"property float {name}" for name in ("x", "y", "z", "intensity")),
        *((f"element face {faces}", f"property list {length} int vertex_indices") if faces else ()),
        "end_header\n",
    ]
    return "\n".join(header).encode()


def _ply(encoding: str, faces: int) -> bytes:
    order = ">" if "big" in encoding else "<"
    vertices = scene(POINTS).astype(f"{order}f4").tobytes() if "binary" in encoding else lines()
    face = struct.pack(f"{order}B3i", 3, 0, 1, 2) if "binary" in encoding else b"3 0 1 2\n"
    return _header(encoding, POINTS, faces, "uchar") + vertices + face * faces
