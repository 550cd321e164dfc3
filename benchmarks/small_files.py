"""Shows whether files of one scan each hold a training back.

    python benchmarks/small_files.py WADS --out copies

Scans a second, each alone on one core: the bytes of single files, in random order, and of one tar
file of the same scans, front to back, both from the disk and from memory; then what derain makes of
the bytes in training, a scan read and checked. Beside it lies the step of each network, of
benchmarks/training.py. The copies in OUT are of the scans of sequence 36.
"""

import argparse
import os
import random
import shutil
import tarfile
import time
from collections.abc import Callable, Iterable
from pathlib import Path

from derain.datamodules.folder import Folder
from derain.evaluation.text_tables import markdown_table
from derain.export.timing import versions


def main() -> None:
    """Prints a table of ways to read."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("root", type=Path, metavar="WADS")
    parser.add_argument("--out", type=Path, required=True, help="folder for the copies")
    parser.add_argument("--scans", type=int, default=200)
    arguments = parser.parse_args()

    scans = _copies(arguments.root / "sequences/36", arguments.out, arguments.scans)
    shard = arguments.out / "scans.tar"
    with tarfile.open(shard, "w") as tar:
        for scan in scans:
            for file in _files(scan):
                tar.add(file)
    os.sync()  # only what is on the disk can be evicted
    random.Random(0).shuffle(scans)
    files = [file for scan in scans for file in _files(scan)]
    rows = []
    for place, prepare in (("disk", _evict), ("memory", _touch)):
        prepare(files)
        rows.append((f"bytes of files, {place}", _rate(lambda: _touch(files), len(scans))))
        prepare([shard])
        rows.append((f"bytes of a tar, {place}", _rate(lambda: _touch([shard]), len(scans))))
    data = Folder(str(arguments.out), "wads", ["velodyne/*.bin"], ["velodyne/*.bin"])
    rows.append(("a scan and its labels", _rate(lambda: _read(data), len(scans))))
    print(markdown_table(("what", "scans/s"), rows))
    print(versions())


def _copies(sequence: Path, folder: Path, number: int) -> list[Path]:
    originals = sorted((sequence / "velodyne").iterdir())
    copies = []
    for index in range(number):
        original = originals[index % len(originals)]
        scan = folder / "velodyne" / f"{index:06}.bin"
        for source, copy in zip(_files(original), _files(scan), strict=True):
            copy.parent.mkdir(parents=True, exist_ok=True)
            shutil.copyfile(source, copy)
        copies.append(scan)
    os.sync()
    return copies


def _files(scan: Path) -> list[Path]:
    """A scan and its labels."""
    return [scan, scan.parent.parent / "labels" / f"{scan.stem}.label"]


def _evict(files: Iterable[Path]) -> None:
    """Has the system forget what it keeps of files in memory."""
    for file in files:
        with file.open("rb") as opened:
            os.posix_fadvise(opened.fileno(), 0, 0, os.POSIX_FADV_DONTNEED)


def _touch(files: Iterable[Path]) -> None:
    """Reads files from beginning to end, a megabyte at a time."""
    for file in files:
        with file.open("rb", buffering=0) as opened:
            while opened.read(1 << 20):
                pass


def _read(data: Folder) -> None:
    for frame in data.source("train"):
        data.read(frame)


def _rate(work: Callable[[], object], scans: int) -> str:
    start = time.perf_counter()
    work()
    return f"{scans / (time.perf_counter() - start):.0f}"


if __name__ == "__main__":
    main()
