"""Scan files of every format that derain reads, and labels."""

import gzip
import tempfile
from pathlib import Path
from random import Random

import numpy as np

from benchmarks.fuzzing.formats import INPUTS, POINTS, deflated_zeros
from benchmarks.fuzzing.mutations import damaged
from benchmarks.fuzzing.reader import Reader
from derain import files
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.format import FORMATS
from derain.files.labels import read_labels
from derain.scan import Scan, class_ids


def readers() -> list[Reader]:
    """One for each format, those of compressed files included, and one for labels."""
    # A format whose library is not installed can be neither written nor read.
    known = [name for name, each in FORMATS.items() if not each.EXTRA or each.EXTRA.installed]
    formats = [_reader(suffix) for suffix in known]
    packed = [_packed(reader) for reader in formats if reader.file in ("scan.bin", "scan.ply")]
    labels = Reader("label", "scan.label", _read_labels, lambda: [bytes(range(4 * POINTS))])
    return [*formats, *packed, labels]


def _reader(suffix: str) -> Reader:
    """The reader of a format; of one from outside derain, what derain writes is damaged."""
    if suffix not in INPUTS:
        return Reader(suffix[1:], f"scan{suffix}", _read_scan, lambda: _written(suffix))
    inputs = INPUTS[suffix]

    def seeds() -> list[bytes]:
        return [*_written(suffix), *inputs.by_others()]

    return Reader(suffix[1:], f"scan{suffix}", _read_scan, seeds, inputs.hostile, inputs.own_damage)


def _packed(reader: Reader) -> Reader:
    """The same format within gzip, its content and its wrapping damaged by turns."""

    def change(generator: Random) -> bytes:
        seeds = reader.seeds()
        content = damaged(generator.choice(seeds), generator.choice(seeds), generator)
        return gzip.compress(content, 1, mtime=0)

    def seeds() -> list[bytes]:
        return [gzip.compress(content, mtime=0) for content in reader.seeds()]

    return Reader(
        f"{reader.name}.gz", f"{reader.file}.gz", _read_scan, seeds, (_gzip_bomb,), change
    )


def _read_scan(path: Path) -> None:
    scan = files.read_scan(path)
    count = len(scan)
    assert scan.xyz.dtype == np.float32, scan.xyz.dtype
    assert scan.xyz.shape == (count, 3), scan.xyz.shape
    if scan.intensity is not None:
        assert scan.intensity.dtype == np.float32, scan.intensity.dtype
        assert scan.intensity.shape == (count,), scan.intensity.shape
    for name, column in scan.fields.items():
        assert len(column) == count, f"{name!r} has {len(column)} rows of {count}"
    if scan.shape is not None:
        assert scan.shape[0] * scan.shape[1] == count, scan.shape
    assert scan.valid.shape == (count,)
    assert np.isfinite(scan.range[scan.valid]).all()


def _read_labels(path: Path) -> None:
    ids = class_ids(read_labels(path, POINTS))
    assert ids.shape == (POINTS,)
    assert 0 <= ids.min() <= ids.max() <= 0xFFFF


def _written(suffix: str) -> list[bytes]:
    """Files that derain writes, in as far as the format can hold the columns."""
    points = scene(POINTS)
    columns = dict(zip(("x", "y", "z", "intensity"), points.T, strict=True))
    more = {"ring": np.arange(POINTS, dtype=np.uint16), "time": np.linspace(0, 0.1, POINTS)}
    contents = []
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / f"scan{suffix}"
        for fields in ({}, columns, columns | more):
            try:
                files.write_scan(
                    path, Scan(points[:, :3].copy(), points[:, 3].copy(), fields=fields)
                )
                files.read_scan(path)
            except InputError:  # a format that cannot hold these columns, or is only read
                continue
            contents.append(path.read_bytes())
    return contents


def _gzip_bomb() -> bytes:
    return b"\x1f\x8b\x08\0\0\0\0\0\0\x03" + deflated_zeros(b"") + bytes(8)
