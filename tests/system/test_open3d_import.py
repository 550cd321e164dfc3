"""Open3D is imported, or an error names what is missing; and TensorBoard starts beside it."""

import os
import shutil
import subprocess
import sys
from types import ModuleType, SimpleNamespace

import pytest

import derain.system.open3d_import
from derain.errors import InputError
from derain.system.open3d_import import (
    LIBUSB,
    SET_UP,
    import_open3d,
    link_libusb,
    warn_where_tensorboard_cannot_start,
)


@pytest.fixture
def installed(tmp_path, monkeypatch) -> SimpleNamespace:
    """An Open3D and a libusb of our own, on a machine whose system has no libusb."""
    library = tmp_path / "libusb_package/libusb-1.0.so"
    folder = tmp_path / "open3d"
    for path in (library, folder / "__init__.py"):
        path.parent.mkdir()
        path.touch()
    loaded: list[str] = []

    def load(name: str, mode: int = 0) -> None:
        if name == LIBUSB:
            raise OSError("cannot open shared object file")
        loaded.append(name)

    package = SimpleNamespace(get_library_path=lambda: library)
    monkeypatch.setitem(sys.modules, "libusb_package", package)
    spec = SimpleNamespace(origin=str(folder / "__init__.py"))
    monkeypatch.setattr(derain.system.open3d_import, "find_spec", {"open3d": spec}.get)
    monkeypatch.setattr(derain.system.open3d_import.ctypes, "CDLL", load)
    monkeypatch.setattr(sys, "platform", "linux")
    return SimpleNamespace(library=library, link=folder / LIBUSB, loaded=loaded)


@pytest.mark.parametrize("gone", [False, True])
def test_the_library_lies_where_open3d_looks(installed, gone) -> None:
    if gone:  # a link to a package that was there once
        installed.link.symlink_to("gone/libusb-1.0.so")
    assert link_libusb() == installed.link
    assert link_libusb() is None  # nothing is lacking any more
    assert installed.link.samefile(installed.library)
    assert not os.path.isabs(installed.link.readlink())  # an environment may be moved
    assert installed.loaded == []


def test_a_link_that_cannot_be_made_is_reported(installed) -> None:
    shutil.rmtree(installed.link.parent)
    with pytest.raises(InputError, match=LIBUSB):
        link_libusb()


def test_a_library_of_the_system_is_left_to_serve(installed, monkeypatch) -> None:
    monkeypatch.setattr(derain.system.open3d_import.ctypes, "CDLL", lambda name: None)
    assert link_libusb() is None


def test_a_command_loads_the_library_and_writes_nothing_beside_open3d(
    installed, monkeypatch
) -> None:
    monkeypatch.setitem(sys.modules, "open3d", ModuleType("open3d"))
    import_open3d()
    assert installed.loaded == [str(installed.library)]
    assert not installed.link.is_symlink()


def test_a_training_warns_of_what_tensorboard_lacks_and_writes_nothing_beside_open3d(
    installed, run_derain, capsys
) -> None:
    outcome = run_derain("fit", "--config", "outdet_wads.yaml", "--trainer.max_epoch", "1")
    assert f"{LIBUSB}; `{SET_UP}`" in outcome.err
    assert not installed.link.is_symlink()
    link_libusb()
    warn_where_tensorboard_cannot_start()
    assert capsys.readouterr().err == ""


@pytest.mark.usefixtures("open3d")
def test_tensorboard_loads_its_plug_ins_once_the_link_is_made() -> None:
    load = "from tensorboard.default import get_dynamic_plugins; print(get_dynamic_plugins())"
    assert "Open3DPlugin" in subprocess.check_output([sys.executable, "-c", load], text=True)


def test_without_open3d_a_training_on_worlds_names_what_to_install_and_leaves_nothing(
    run_derain, here, monkeypatch
) -> None:
    monkeypatch.setitem(sys.modules, "open3d", None)
    outcome = run_derain("fit", "--config", "outdet_simulated.yaml", "--data.root", "facility")
    assert outcome.code == 2
    line = outcome.err.splitlines()[-1]
    assert "needs open3d, which is not installed. pip install 'derain[scene]'" in line
    assert not list(here.glob("facility/*"))
