"""What is compressed in bags is unpacked up to a size, and no further."""

import bz2
import os
import pickle
import subprocess
import sys
import tempfile
from collections.abc import Callable
from pathlib import Path

import lz4.frame
import pytest
import zstandard
from small_bags import small_bag, storage_file

from derain.bags import unpacking
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
def test_as_much_as_allowed_is_unpacked_and_no_more(compression, monkeypatch) -> None:
    monkeypatch.setattr(unpacking, "MOST_UNPACKED", 2_000_000)
    pack = PACKERS[compression]
    assert unpack(pack(bytes(2_000_000)), compression) == bytes(2_000_000)
    with pytest.raises(ValueError, match="more than 2 MB"):
        unpack(pack(bytes(2_000_001)), compression)


@pytest.mark.parametrize("compression", ["bz2", "lz4", "zstd"])
def test_what_is_cut_off_or_no_such_thing_is_refused(compression) -> None:
    packed = PACKERS[compression](bytes(range(256)) * 40)
    for damaged in (packed[:-4], b"", b"spam" * 20):
        with pytest.raises((ValueError, OSError, RuntimeError, zstandard.ZstdError)):
            unpack(damaged, compression)
    with pytest.raises(ValueError, match="'xz' is not known"):
        unpack(b"", "xz")


@pytest.fixture
def compressed_bag(tmp_path, monkeypatch) -> Path:
    """A bag whose file is compressed as a whole; it is unpacked to ``tmp``."""
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
    return bag


def test_files_that_do_not_fit_on_the_disk_are_refused(
    compressed_bag, tmp_path, monkeypatch
) -> None:
    monkeypatch.setattr(unpacking, "LEFT", 2**62)
    with pytest.raises(InputError, match="more than the free space"):
        named_frames([compressed_bag])
    assert not list((tmp_path / "tmp").iterdir())


def test_a_bag_is_unpacked_once_for_all_who_read_it(compressed_bag, tmp_path, monkeypatch) -> None:
    frames = named_frames([compressed_bag])
    again = named_frames([compressed_bag / "000001"])
    # What another process gets, which has unpacked nothing.
    others = pickle.loads(pickle.dumps(frames))
    monkeypatch.setattr(unpacking, "_UNPACKED", {})
    monkeypatch.setattr(unpacking, "_unpack_file", None)
    assert [len(frame.read()) for frame in (*frames, *again, *others)] == [300] * 7
    assert len(list((tmp_path / "tmp").iterdir())) == 1


# Reads in another process, which ends first, and then in the one that has unpacked the bag.
READS = """
import multiprocessing, os, sys, tempfile
from pathlib import Path
from derain.sources.folders import named_frames

def read(frame):
    assert len(frame.read()) == 300

tempfile.tempdir = sys.argv[2]
frames = named_frames([Path(sys.argv[1])])
other = multiprocessing.get_context("fork").Process(target=read, args=[frames[1]])
other.start()
other.join()
assert other.exitcode == 0
read(frames[2])
assert len(os.listdir(sys.argv[2])) == 1
"""


@pytest.mark.skipif(not hasattr(os, "fork"), reason="the system has no fork")
def test_what_is_unpacked_is_gone_when_the_process_ends_and_not_when_one_that_it_began_does(
    compressed_bag, tmp_path
) -> None:
    subprocess.run([sys.executable, "-c", READS, compressed_bag, tmp_path / "tmp"], check=True)
    assert not list((tmp_path / "tmp").iterdir())
