"""A file is written whole or not at all, and what killed processes leave is recognised."""

import errno
import os
import sys
from pathlib import Path
from typing import Any

import pytest

from derain import InputError
from derain.files import atomic
from derain.files.atomic import (
    lock,
    remove_abandoned,
    replacing,
    require_writable_folder,
    temporary_folder,
)


def write(path: Path) -> None:
    """A writer that ends well."""
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")


def write_half(path: Path, error: BaseException) -> None:
    """A writer that fails halfway."""
    with replacing(path) as temporary:
        temporary.write_bytes(b"half")
        raise error


def test_the_file_appears_when_the_block_ends_in_a_folder_that_is_made(tmp_path) -> None:
    path = tmp_path / "a" / "b" / "scan.bin"
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
        assert not path.exists()
        assert [entry.name[0] for entry in path.parent.iterdir()] == ["."]
    assert path.read_bytes() == b"new"
    assert list(path.parent.iterdir()) == [path]


FULL = OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))


@pytest.mark.parametrize(
    ("error", "raised"),
    [
        (KeyboardInterrupt(), KeyboardInterrupt),
        (BrokenPipeError(), BrokenPipeError),  # of what the writer prints to, never of the file
        (FULL, InputError),
    ],
)
def test_a_writer_that_fails_leaves_the_old_file_and_no_temporary(tmp_path, error, raised) -> None:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"old")
    with pytest.raises(raised):
        write_half(path, error)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("mode", [None, 0o600, 0o755])
def test_a_file_has_the_permissions_of_the_one_before_it_or_of_any_new_one(tmp_path, mode) -> None:
    path, plain = tmp_path / "scan", tmp_path / "plain"
    plain.touch()
    if mode is not None:
        path.touch()
        path.chmod(mode)
        plain.chmod(mode)
    write(path)
    assert (path.read_bytes(), path.stat().st_mode) == (b"new", plain.stat().st_mode)


@pytest.mark.parametrize("dangling", [False, True])
def test_a_link_leads_to_the_new_file(tmp_path, dangling) -> None:
    target, link = tmp_path / "elsewhere/scan.bin", tmp_path / "scan.bin"
    target.parent.mkdir()
    if not dangling:
        target.write_bytes(b"old")
    link.symlink_to("elsewhere/scan.bin")
    write(link)
    assert os.readlink(link) == "elsewhere/scan.bin"
    assert target.read_bytes() == b"new"
    assert list(target.parent.iterdir()) == [target]


def test_what_cannot_be_written_is_an_error(tmp_path) -> None:
    (tmp_path / "file").touch()
    for path in (tmp_path, Path(), Path("/"), Path(os.devnull)):
        with pytest.raises(InputError, match="is not a file that can be replaced"):
            write(path)
    with pytest.raises(InputError, match=r"scan\.bin: cannot be written \(.+\)"):
        write(tmp_path / "file" / "scan.bin")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_an_error(tmp_path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        write(tmp_path / "scan.bin")
    with pytest.raises(InputError, match=r"out/below: cannot be written \(Permission denied\)"):
        require_writable_folder(tmp_path / "out/below")


def test_a_folder_to_be_made_is_looked_at_and_not_made(tmp_path) -> None:
    require_writable_folder(tmp_path / "out/below")
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"file/below: cannot be written"):
        require_writable_folder(tmp_path / "file/below")
    assert [path.name for path in tmp_path.iterdir()] == ["file"]


@pytest.mark.parametrize("function", [(os, "open"), (atomic, "lock")], ids=["open", "lock"])
def test_a_folder_that_was_taken_for_abandoned_is_made_anew(
    tmp_path, monkeypatch, function
) -> None:
    called, taken = getattr(*function), list[Path]()

    def taken_first(*arguments: Any, **options: Any) -> Any:
        if not taken:  # another process removes it just before the first call
            taken.extend(tmp_path.iterdir())
            taken[0].rmdir()
        return called(*arguments, **options)

    monkeypatch.setattr(*function, taken_first)
    with temporary_folder(tmp_path) as lent:
        (lent / "file").write_bytes(b"new")
        descriptor = os.open(lent, os.O_RDONLY)
        assert not lock(descriptor, wait=False)
        os.close(descriptor)
    assert len(taken) == 1
    assert not list(tmp_path.iterdir())


@pytest.mark.parametrize("locks", [True, False])
def test_what_a_killed_process_left_goes_and_what_is_in_use_stays(
    tmp_path, monkeypatch, locks
) -> None:
    (tmp_path / f"{atomic.PREFIX}0.bin").touch()  # as earlier versions left them
    (tmp_path / f"{atomic.PREFIX}1").mkdir()
    if not locks:
        monkeypatch.setitem(sys.modules, "fcntl", None)  # as on Windows
    with temporary_folder(tmp_path) as in_use:
        remove_abandoned.cache_clear()
        write(tmp_path / "file.bin")
        assert in_use.exists()
    left = {path.name for path in tmp_path.iterdir()} - {"file.bin"}
    assert left == (set() if locks else {f"{atomic.PREFIX}0.bin", f"{atomic.PREFIX}1"})
