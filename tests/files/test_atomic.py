"""A file is written whole or not at all."""

import errno
import os
from pathlib import Path

import pytest

from derain import InputError
from derain.files.atomic import replacing


def write_half(path: Path, error: BaseException) -> None:
    """A writer that fails halfway."""
    with replacing(path) as temporary:
        temporary.write_bytes(b"half")
        raise error


def test_the_file_appears_when_the_block_ends(tmp_path: Path) -> None:
    path = tmp_path / "scan.bin"
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
        assert not path.exists()
        assert temporary.parent == tmp_path
        assert temporary.suffix == ".bin"
        assert temporary.name.startswith(".")
    assert path.read_bytes() == b"new"
    assert list(tmp_path.iterdir()) == [path]


def test_a_writer_that_raises_leaves_the_old_file_and_no_temporary(tmp_path: Path) -> None:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"old")
    with pytest.raises(ZeroDivisionError):
        write_half(path, ZeroDivisionError())
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_an_interrupted_writer_leaves_nothing(tmp_path: Path) -> None:
    with pytest.raises(KeyboardInterrupt):
        write_half(tmp_path / "scan.bin", KeyboardInterrupt())
    assert list(tmp_path.iterdir()) == []


def test_a_missing_folder_is_created(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "scan.bin"
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
    assert path.read_bytes() == b"new"


def test_the_new_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    with replacing(tmp_path / "scan") as temporary:
        temporary.write_bytes(b"new")
    assert (tmp_path / "scan").stat().st_mode == plain.stat().st_mode


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_file_that_is_replaced_passes_on_its_permissions(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "scan"
    path.touch()
    path.chmod(mode)
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
    assert (path.read_bytes(), path.stat().st_mode & 0o777) == (b"new", mode)


@pytest.mark.parametrize("dangling", [False, True])
def test_a_link_leads_to_the_new_file(tmp_path: Path, dangling: bool) -> None:
    target, link = tmp_path / "elsewhere/scan.bin", tmp_path / "scan.bin"
    target.parent.mkdir()
    if not dangling:
        target.write_bytes(b"old")
    link.symlink_to("elsewhere/scan.bin")
    with replacing(link) as temporary:
        temporary.write_bytes(b"new")
    assert os.readlink(link) == "elsewhere/scan.bin"
    assert target.read_bytes() == b"new"
    assert list(target.parent.iterdir()) == [target]


def test_a_broken_pipe_is_no_fault_of_the_file(tmp_path: Path) -> None:
    with pytest.raises(BrokenPipeError):
        write_half(tmp_path / "scan.bin", BrokenPipeError())
    assert list(tmp_path.iterdir()) == []


def test_a_folder_is_not_replaced(tmp_path: Path) -> None:
    for folder in (tmp_path, Path(), Path("/")):
        with pytest.raises(InputError, match=r"is not a file that can be replaced\. Name a file"):
            replacing(folder).__enter__()


def test_a_device_is_not_replaced() -> None:
    with pytest.raises(InputError, match=r"not a file that can be replaced"):
        replacing(Path(os.devnull)).__enter__()


def test_a_file_in_place_of_the_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"scan\.bin: cannot be written \(.+\)\. Choose a folder"):
        replacing(tmp_path / "file" / "scan.bin").__enter__()


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_an_error(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        replacing(tmp_path / "scan.bin").__enter__()


def test_a_full_disk_is_an_error_and_leaves_the_old_file(tmp_path: Path) -> None:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"old")
    with pytest.raises(InputError, match=r"cannot be written \(No space left on device\)"):
        write_half(path, OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)))
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize(
    "name", [f"a.{'b' * 253}", f"{'a' * 251}.bin", f".{'é' * 127}", "a.b.c.npz"]
)
def test_a_name_may_be_as_long_as_names_may_be(tmp_path: Path, name: str) -> None:
    with replacing(tmp_path / name) as temporary:
        temporary.write_text("whole")
    assert [path.name for path in tmp_path.iterdir()] == [name]
    assert (tmp_path / name).read_text() == "whole"
