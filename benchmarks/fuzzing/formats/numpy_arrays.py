"""NumPy's own files: one array (`.npy`) or several named ones (`.npz`)."""

import io
import struct
import zipfile
from collections.abc import Callable, Sequence
from random import Random

import numpy as np

from benchmarks.fuzzing.format_inputs import (
    BOMB,
    INPUTS,
    POINTS,
    FormatInputs,
    deflated_zeros,
    npy,
)
from benchmarks.fuzzing.mutations import damaged
from derain.evaluation.hard_cases import scene


@INPUTS.add(".npy")
class NpyInputs(FormatInputs):
    """One array."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """Headers that would fill the memory, and one of pickled objects, which may be programs."""
        return (
            # No rows, and columns that would fill the memory, were an array made of each.
            lambda: _header((0, 10**9), "<f4"),
            lambda: _header((10**12, 4), "<f4"),
            lambda: _header((10**12,), "|O") + b"cos\nsystem\n(S'true'\ntR.",
        )

    def by_others(self, suffix: str) -> Sequence[bytes]:
        """Plain, organised and structured."""
        return (npy(scene(POINTS)), npy(scene(POINTS).reshape(5, -1, 4)), _structured())


@INPUTS.add(".npz")
class NpzInputs(FormatInputs):
    """Several arrays."""

    def hostile(self, suffix: str) -> Sequence[Callable[[], bytes]]:
        """An archive that unfolds to more than the memory."""
        return (_zip_bomb,)

    def own_damage(self) -> Callable[[Random], bytes]:
        """Arrays that are damaged one by one, in a sound archive."""
        return _damaged_arrays


def _structured() -> bytes:
    rows = np.zeros(POINTS, [("x", "<f4"), ("y", ">f4"), ("z", "<f8"), ("intensity", "u1")])
    for name, column in zip(rows.dtype.names or (), scene(POINTS).T, strict=True):
        rows[name] = column
    return npy(rows)


def _header(shape: tuple[int, ...], kind: str) -> bytes:
    file = io.BytesIO()
    header = {"descr": kind, "fortran_order": False, "shape": shape}
    np.lib.format.write_array_header_1_0(file, header)
    return file.getvalue()


def _zip_bomb() -> bytes:
    """An .npz with one large array of zeros. Source: PKWARE, APPNOTE.TXT, section 4.3."""
    rows = BOMB * 10**6 // 16
    start = npy(np.zeros((0, 4), np.float32)).replace(b"(0, 4)", f"({rows}, 4)".encode())
    packed, name = deflated_zeros(start[: 128 - 10] + b" " * 9 + b"\n"), b"points.npy"
    sizes = struct.pack("<3I2H", 0, len(packed), BOMB * 10**6 + 128, len(name), 0)
    common = struct.pack("<5H", 20, 0, 8, 0, 0)
    local = b"PK\3\4" + common + sizes + name + packed
    central = b"PK\1\2" + b"\x14\0" + common + sizes + struct.pack("<3H2I", 0, 0, 0, 0, 0) + name
    return (
        local
        + central
        + struct.pack("<4s4H2IH", b"PK\5\6", 0, 0, 1, 1, len(central), len(local), 0)
    )


def _damaged_arrays(generator: Random) -> bytes:
    columns = dict(zip(("x", "y", "z", "intensity"), scene(POINTS).T, strict=True))
    method = generator.choice((zipfile.ZIP_STORED, zipfile.ZIP_DEFLATED))
    file = io.BytesIO()
    with zipfile.ZipFile(file, "w", method) as archive:
        for name, column in columns.items():
            content = npy(column)
            if generator.random() < 0.3:
                content = damaged(content, _structured(), generator)
            archive.writestr(f"{name}.npy", content)
    return file.getvalue()
