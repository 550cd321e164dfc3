"""Locks: one holder at a time, none after it is gone, and none where the system has none."""

import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import pytest

from derain.files import temporary
from derain.files.atomic import replacing
from derain.files.lock import lock


def test_a_file_has_one_holder_until_it_closes_it(tmp_path: Path) -> None:
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
    module = {"open": os, "lock": temporary}[request.param]
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
    with replacing(tmp_path / "file") as lent:
        lent.write_bytes(b"new")
    assert len(taken) == 1
    assert (tmp_path / "file").read_bytes() == b"new"


@pytest.mark.parametrize("taken", ["open", "lock"], indirect=True)
def test_a_folder_that_was_taken_for_abandoned_is_made_anew(
    tmp_path: Path, taken: list[Path]
) -> None:
    with temporary.temporary_folder(tmp_path) as lent:
        (lent / "file").write_bytes(b"new")
        descriptor = os.open(lent, os.O_RDONLY)
        assert not lock(descriptor, wait=False)
        os.close(descriptor)
    assert len(taken) == 1
    assert not list(tmp_path.iterdir())


@pytest.fixture
def without_locks(monkeypatch: pytest.MonkeyPatch) -> None:
    """A system such as Windows."""
    monkeypatch.setitem(sys.modules, "fcntl", None)


@pytest.mark.usefixtures("without_locks")
def test_without_locks_files_are_written_and_nothing_is_taken_for_abandoned(
    tmp_path: Path,
) -> None:
    other = tmp_path / f"{temporary.PREFIX}0.bin"
    other.write_bytes(b"perhaps in use")
    with replacing(tmp_path / "file.bin") as lent:
        lent.write_bytes(b"new")
    assert (tmp_path / "file.bin").read_bytes() == b"new"
    assert set(tmp_path.iterdir()) == {other, tmp_path / "file.bin"}


def test_the_simulation_loads_where_there_are_no_locks() -> None:
    code = "import sys; sys.modules['fcntl'] = None; import derain.simulation.dataset"
    subprocess.run([sys.executable, "-c", code], check=True)
