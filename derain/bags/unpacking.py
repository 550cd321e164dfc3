"""Unpacks what bags hold compressed, and no more of it than a recording needs.

A few kilobytes may unpack to more than there is memory. The libraries that read bags unpack
whatever they find; here it ends at a size.
"""

import bz2
from collections.abc import Callable, Mapping
from typing import Any

from derain.system.extras import LZ4, ZSTANDARD

# The most that a chunk or a message may take, bytes: a cloud of eight million points of 32 bytes.
MOST_UNPACKED = 2**28


def unpack(data: bytes, compression: str) -> bytes:
    """Unpacks a chunk or a message.

    Args:
        data: Its bytes.
        compression: ``bz2``, ``lz4``, ``zstd``; ``""`` and ``none`` mean none.

    Raises:
        ValueError: Another compression, damaged bytes, or more than MOST_UNPACKED.
    """
    if compression not in UNPACKERS:
        raise ValueError(f"the compression '{compression}' is not known")
    unpacked = UNPACKERS[compression](data)
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


def _plain(data: bytes) -> bytes:
    return data


def _bz2(data: bytes) -> bytes:
    return _whole(bz2.BZ2Decompressor(), data)


def _lz4(data: bytes) -> bytes:
    return _whole(LZ4.load("bags", "frame").LZ4FrameDecompressor(), data)


def _zstd(data: bytes) -> bytes:
    library = ZSTANDARD.load("bags")
    check_size(library.frame_content_size(data))  # -1 where it does not say
    unpacked: bytes = library.decompress(data, MOST_UNPACKED)
    return unpacked


def _whole(decompressor: Any, data: bytes) -> bytes:
    unpacked: bytes = decompressor.decompress(data, MOST_UNPACKED + 1)
    if not decompressor.eof and len(unpacked) <= MOST_UNPACKED:
        raise ValueError("compressed data that ends too early")
    return unpacked


UNPACKERS: Mapping[str, Callable[[bytes], bytes]] = {
    "": _plain,
    "none": _plain,
    "bz2": _bz2,
    "lz4": _lz4,
    "zstd": _zstd,
}
