"""What is compressed in bags is unpacked up to a size, and no further."""

import bz2
import tempfile
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from small_bags import small_bag, storage_file

from derain.bags import unpacked_files, unpacking
from derain.bags.unpacking import unpack
from derain.errors import InputError
from derain.sources.folders import named_frames

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


def test_files_that_do_not_fit_on_the_disk_are_refused(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bag = small_bag(tmp_path, "sqlite3")
    file = storage_file(bag)
    file.with_name(f"{file.name}.zstd").write_bytes(zstandard.compress(file.read_bytes()))
    text = (bag / "metadata.yaml").read_text("utf-8")
    text = text.replace(file.name, f"{file.name}.zstd")
    text = text.replace("compression_mode: ''", "compression_mode: FILE")
    text = text.replace("compression_format: ''", "compression_format: zstd")
    (bag / "metadata.yaml").write_text(text, "utf-8")
    file.unlink()
    (tmp_path / "tmp").mkdir()
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "tmp"))

    assert len(named_frames([bag])) == 3
    monkeypatch.setattr(unpacked_files, "LEFT", 2**62)
    with pytest.raises(InputError, match="more than there is room for"):
        named_frames([bag])
    assert not list((tmp_path / "tmp").iterdir())


def test_another_compression_is_refused() -> None:
    with pytest.raises(ValueError, match="'xz' is not known"):
        unpack(b"", "xz")
