"""What is compressed in bags is unpacked up to a size, and no further."""

import bz2
from collections.abc import Callable

import lz4.frame
import pytest
import zstandard

from derain.bags import unpacking
from derain.bags.unpacking import unpack

PACKERS: dict[str, Callable[[bytes], bytes]] = {
    "": bytes,
    "none": bytes,
    "bz2": bz2.compress,
    "lz4": lz4.frame.compress,
    "zstd": zstandard.compress,
}


@pytest.mark.parametrize("compression", PACKERS)
def test_as_much_as_allowed_is_unpacked_and_no_more(
    compression: str, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(unpacking, "MOST_UNPACKED", 2_000_000)
    pack = PACKERS[compression]
    assert unpack(pack(bytes(2_000_000)), compression) == bytes(2_000_000)
    with pytest.raises(ValueError, match="more than 2 MB"):
        unpack(pack(bytes(2_000_001)), compression)


@pytest.mark.parametrize("compression", ["bz2", "lz4", "zstd"])
def test_what_is_cut_off_or_no_such_thing_is_refused(compression: str) -> None:
    packed = PACKERS[compression](bytes(range(256)) * 40)
    for damaged in (packed[:-4], b"", b"spam" * 20):
        with pytest.raises((ValueError, OSError, RuntimeError, zstandard.ZstdError)):
            unpack(damaged, compression)


def test_another_compression_is_refused() -> None:
    with pytest.raises(ValueError, match="'xz' is not known"):
        unpack(b"", "xz")
