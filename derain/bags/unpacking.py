"""Unpacks compressed chunks, messages and files of bags, up to a size.

A few kilobytes may unpack to more than the memory, and the libraries that read bags have no bound.
"""

import atexit
import bz2
import shutil
import tempfile
from contextlib import ExitStack
from pathlib import Path
from typing import Any

from derain.bags.ros2_metadata import Ros2Metadata
from derain.files.atomic import temporary_folder
from derain.system.extras import LZ4, ZSTANDARD

# The most that a chunk or a message may take, bytes: a cloud of eight million points of 32 bytes.
MOST_UNPACKED = 2**28

# Bytes of a file that are read at once, and that are left on the disk for others.
PORTION, LEFT = 2**22, 2**30


def unpack(data: bytes, compression: str) -> bytes:
    """Unpacks a chunk or a message.

    Args:
        data: Its bytes.
        compression: ``bz2``, ``lz4``, ``zstd``; ``""`` and ``none`` mean none.

    Raises:
        ValueError: Another compression, damaged bytes, or more than MOST_UNPACKED.
    """
    match compression:
        case "" | "none":
            unpacked = data
        case "bz2":
            unpacked = _whole(bz2.BZ2Decompressor(), data)
        case "lz4":
            unpacked = _whole(LZ4.load("bags", "frame").LZ4FrameDecompressor(), data)
        case "zstd":
            library = ZSTANDARD.load("bags")
            check_size(library.frame_content_size(data))  # -1 where the frame has none
            unpacked = library.decompress(data, MOST_UNPACKED)
        case _:
            raise ValueError(f"the compression '{compression}' is not known")
    check_size(len(unpacked))
    return unpacked


def check_size(size: int) -> None:
    """Refuses what is larger than anything in a recording.

    Args:
        size: Bytes of a chunk or a message.

    Raises:
        ValueError: More than MOST_UNPACKED.
    """
    if size > MOST_UNPACKED:
        raise ValueError(f"a chunk or message of more than {MOST_UNPACKED // 10**6} MB")


def _whole(decompressor: Any, data: bytes) -> bytes:
    unpacked: bytes = decompressor.decompress(data, MOST_UNPACKED + 1)
    if not decompressor.eof and len(unpacked) <= MOST_UNPACKED:
        raise ValueError("compressed data that ends too early")
    return unpacked


# Folders of what this process has unpacked, by what identified the bag's files then.
_UNPACKED: dict[tuple[object, ...], Path] = {}


def unpacked_bag(folder: Path, metadata: Ros2Metadata) -> Path:
    """The folder with the files of a bag unpacked, which this process removes when it ends.

    Args:
        folder: The bag's folder.
        metadata: Its metadata.yaml.

    Raises:
        ValueError: A damaged file, or one that unpacks to more than there is room for.
        OSError: A file cannot be read or written.
    """
    files = [(folder / name).stat() for name in metadata.files]
    key = (*((f.st_dev, f.st_ino, f.st_size, f.st_mtime_ns) for f in files), repr(metadata))
    if key not in _UNPACKED or not _UNPACKED[key].is_dir():
        with ExitStack() as stack:
            lent = stack.enter_context(temporary_folder(Path(tempfile.gettempdir())))
            lent.chmod(0o700)  # the folder of temporary files is open to all users
            plain = metadata.unpacked()
            for packed, file in zip(metadata.files, plain.files, strict=True):
                _unpack_file(folder / packed, lent / file)
            plain.write(lent)
            atexit.register(stack.pop_all().close)
        _UNPACKED[key] = lent
    return _UNPACKED[key]


def _unpack_file(source: Path, target: Path) -> None:
    unpacker = ZSTANDARD.load(source).ZstdDecompressor()
    with (
        source.open("rb") as packed,
        unpacker.stream_reader(packed) as reader,
        target.open("xb") as unpacked,
    ):
        while portion := reader.read(PORTION):
            if shutil.disk_usage(target.parent).free < LEFT + len(portion):
                raise ValueError(
                    f"{source.name} unpacks to more than the free space in {target.parent.parent}"
                )
            unpacked.write(portion)
