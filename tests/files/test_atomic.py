"""A file is written whole or not at all, and what killed processes leave is told from the rest."""

import errno
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from derain import InputError
from derain.files import atomic
from derain.files.atomic import lock, replacing, temporary_folder


def write(path: Path) -> None:
    """A writer that ends well."""
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")


def write_half(path: Path, error: BaseException) -> None:
    """A writer that fails halfway."""
    with replacing(path) as temporary:
        temporary.write_bytes(b"half")
        raise error


def test_the_file_appears_when_the_block_ends_in_a_folder_that_is_made(tmp_path: Path) -> None:
    path = tmp_path / "a" / "b" / "scan.bin"
    with replacing(path) as temporary:
        temporary.write_bytes(b"new")
        assert not path.exists()
        assert temporary.parent == path.parent
        assert temporary.suffix == ".bin"
        assert temporary.name.startswith(".")
    assert path.read_bytes() == b"new"
    assert list(path.parent.iterdir()) == [path]


@pytest.mark.parametrize(
    "error",
    [
        ZeroDivisionError(),
        KeyboardInterrupt(),
        BrokenPipeError(),  # of what the writer prints to, never of the file
        OSError(errno.ENOSPC, os.strerror(errno.ENOSPC)),
    ],
    ids=repr,
)
def test_a_writer_that_fails_leaves_the_old_file_and_no_temporary(
    tmp_path: Path, error: BaseException
) -> None:
    path = tmp_path / "scan.bin"
    path.write_bytes(b"old")
    full = type(error) is OSError
    with pytest.raises(
        InputError if full else type(error), match="No space left on device" if full else None
    ):
        write_half(path, error)
    assert path.read_bytes() == b"old"
    assert list(tmp_path.iterdir()) == [path]


def test_the_new_file_has_the_permissions_of_any_new_file(tmp_path: Path) -> None:
    plain = tmp_path / "plain"
    plain.touch()
    write(tmp_path / "scan")
    assert (tmp_path / "scan").stat().st_mode == plain.stat().st_mode


@pytest.mark.parametrize("mode", [0o600, 0o664, 0o755])
def test_a_file_that_is_replaced_passes_on_its_permissions(tmp_path: Path, mode: int) -> None:
    path = tmp_path / "scan"
    path.touch()
    path.chmod(mode)
    write(path)
    assert (path.read_bytes(), path.stat().st_mode & 0o777) == (b"new", mode)


@pytest.mark.parametrize("dangling", [False, True])
def test_a_link_leads_to_the_new_file(tmp_path: Path, dangling: bool) -> None:
    target, link = tmp_path / "elsewhere/scan.bin", tmp_path / "scan.bin"
    target.parent.mkdir()
    if not dangling:
        target.write_bytes(b"old")
    link.symlink_to("elsewhere/scan.bin")
    write(link)
    assert os.readlink(link) == "elsewhere/scan.bin"
    assert target.read_bytes() == b"new"
    assert list(target.parent.iterdir()) == [target]


def test_folders_and_devices_are_not_replaced(tmp_path: Path) -> None:
    for path in (tmp_path, Path(), Path("/"), Path(os.devnull)):
        with pytest.raises(InputError, match=r"is not a file that can be replaced\. Name a file"):
            write(path)


def test_a_file_in_place_of_the_folder_is_an_error(tmp_path: Path) -> None:
    (tmp_path / "file").touch()
    with pytest.raises(InputError, match=r"scan\.bin: cannot be written \(.+\)\. Choose a folder"):
        write(tmp_path / "file" / "scan.bin")


@pytest.mark.skipif(os.geteuid() == 0, reason="root may write everywhere")
def test_a_folder_without_permission_is_an_error(tmp_path: Path) -> None:
    tmp_path.chmod(0o500)
    with pytest.raises(InputError, match=r"cannot be written \(Permission denied\)"):
        write(tmp_path / "scan.bin")


@pytest.mark.parametrize(
    "name", [f"a.{'b' * 253}", f"{'a' * 251}.bin", f".{'é' * 127}", "a.b.c.npz"]
)
def test_a_name_may_be_as_long_as_names_may_be(tmp_path: Path, name: str) -> None:
    write(tmp_path / name)
    assert [path.name for path in tmp_path.iterdir()] == [name]


def test_a_locked_file_has_one_holder_until_it_closes_it(tmp_path: Path) -> None:
    first, second = (os.open(tmp_path / "file", os.O_CREAT | os.O_RDWR) for _ in range(2))
    assert lock(first, wait=False)
    assert not lock(second, wait=False)
    os.close(first)
    assert lock(second, wait=False)
    os.close(second)


@pytest.fixture
def taken(
    request: pytest.FixtureRequest, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> list[Path]:
    """What another process removed as abandoned, just before the first call of a function."""
    module = {"open": os, "lock": atomic}[request.param]
    called, taken = getattr(module, request.param), list[Path]()

    def taken_first(*arguments: Any, **options: Any) -> Any:
        if not taken:
            taken.extend(tmp_path.iterdir())
            for path in taken:
                path.rmdir() if path.is_dir() else path.unlink()
        return called(*arguments, **options)

    monkeypatch.setattr(module, request.param, taken_first)
    return taken


@pytest.mark.parametrize("taken", ["lock"], indirect=True)
def test_a_file_that_was_taken_for_abandoned_is_made_anew(
    tmp_path: Path, taken: list[Path]
) -> None:
    write(tmp_path / "file")
    assert len(taken) == 1
    assert (tmp_path / "file").read_bytes() == b"new"


@pytest.mark.parametrize("taken", ["open", "lock"], indirect=True)
def test_a_folder_that_was_taken_for_abandoned_is_made_anew(
    tmp_path: Path, taken: list[Path]
) -> None:
    with temporary_folder(tmp_path) as lent:
        (lent / "file").write_bytes(b"new")
        descriptor = os.open(lent, os.O_RDONLY)
        assert not lock(descriptor, wait=False)
        os.close(descriptor)
    assert len(taken) == 1
    assert not list(tmp_path.iterdir())


def test_without_locks_files_are_written_and_nothing_is_taken_for_abandoned(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setitem(sys.modules, "fcntl", None)  # as on Windows
    other = tmp_path / f"{atomic.PREFIX}0.bin"
    other.write_bytes(b"perhaps in use")
    write(tmp_path / "file.bin")
    assert (tmp_path / "file.bin").read_bytes() == b"new"
    assert set(tmp_path.iterdir()) == {other, tmp_path / "file.bin"}


def test_the_simulation_loads_where_there_are_no_locks() -> None:
    code = "import sys; sys.modules['fcntl'] = None; import derain.simulation.dataset"
    subprocess.run([sys.executable, "-c", code], check=True)
