"""Imports Open3D, which is optional, and lets it find libusb, which a bare Debian lacks."""

import contextlib
import ctypes
import os
import sys
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from derain.system.extras import OPEN3D

# What Open3D links against, as the dynamic linker calls it.
LIBUSB = "libusb-1.0.so.0"


def import_open3d() -> ModuleType:
    """Imports Open3D where it is needed; nothing else in derain imports it.

    Returns:
        The module open3d.

    Raises:
        MissingExtraError: Open3D is not installed.
        InputError: A library that it links against is missing.
    """
    make_open3d_loadable()
    return OPEN3D.load("what casts rays or shows a window")


def make_open3d_loadable() -> None:
    """Lets every program load Open3D, not derain alone, where it is installed.

    On Linux, Open3D links against libusb-1.0.so.0, which the wheel libusb-package carries. Loading
    that before Open3D would serve this process alone. TensorBoard, however, loads Open3D's plug-in
    whenever it starts, and dies where it cannot. So a link to the library is left beside Open3D's
    own libraries, which look there first for what they need. Where that folder cannot be written
    to, the library is loaded into this process.
    """
    open3d = find_spec("open3d")
    if sys.platform != "linux" or open3d is None or open3d.origin is None:
        return
    with contextlib.suppress(OSError):
        ctypes.CDLL(LIBUSB)
        return  # the system has it
    with contextlib.suppress(ImportError, OSError):  # importing Open3D then says what it lacks
        import libusb_package

        if library := libusb_package.get_library_path():
            _lay_beside(Path(open3d.origin).parent, library)


def _lay_beside(folder: Path, library: Path) -> None:
    """Links to the library in a folder, or loads it where that cannot be done."""
    link = folder / LIBUSB
    try:
        if not link.exists():
            link.unlink(missing_ok=True)  # it points to a package that was there once
            link.symlink_to(os.path.relpath(library, folder))
    except FileExistsError:
        pass  # another process has just made it
    except OSError:
        ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
