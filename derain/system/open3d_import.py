"""Imports Open3D, which is optional, and lets it find libusb, which a bare Debian lacks.

On Linux, Open3D links against libusb-1.0.so.0, which the wheel libusb-package carries. derain loads
that into its own process before Open3D. TensorBoard, however, loads Open3D's plug-in whenever it
starts, and dies where it cannot. For TensorBoard there has to be a link to the library beside
Open3D's own libraries, which look there first. No command writes into installed packages unasked;

    python -m derain.system.open3d_import

makes the link, and prints its path.
"""

import contextlib
import ctypes
import os
import sys
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from derain.errors import InputError
from derain.system.extras import OPEN3D
from derain.system.notices import warn

# The library that Open3D links against, by its name for the dynamic linker.
LIBUSB = "libusb-1.0.so.0"

SET_UP = "python -m derain.system.open3d_import"


def import_open3d() -> ModuleType:
    """Imports Open3D where it is needed; nothing else in derain imports it.

    Returns:
        The module open3d.

    Raises:
        MissingExtraError: Open3D is not installed.
        InputError: A library that it links against is missing.
    """
    if lacking := _lacking_library():
        _, library = lacking
        with contextlib.suppress(OSError):  # importing Open3D then reports what it lacks
            ctypes.CDLL(str(library), ctypes.RTLD_GLOBAL)
    return OPEN3D.load("what casts rays or shows a window")


def warn_where_tensorboard_cannot_start() -> None:
    """Warns, with the remedy, where TensorBoard would die of Open3D's plug-in."""
    if _lacking_library():
        warn(f"TensorBoard cannot start: Open3D lacks {LIBUSB}; `{SET_UP}` links it")


def link_libusb() -> Path | None:
    """Links to libusb beside Open3D's libraries, for TensorBoard.

    Returns:
        The new link; None where none is needed.

    Raises:
        InputError: The folder of Open3D cannot be written.
    """
    lacking = _lacking_library()
    if lacking is None:
        return None
    link, library = lacking
    try:
        link.unlink(missing_ok=True)  # it points to a package that was there once
        link.symlink_to(os.path.relpath(library, link.parent))
    except FileExistsError:
        pass  # another process has just made it
    except OSError as error:
        raise InputError(
            link, f"cannot be made ({error.strerror})", "Install libusb: apt install libusb-1.0-0."
        ) from error
    return link


def _lacking_library() -> tuple[Path, Path] | None:
    """The place of the link, and the library; None if Open3D finds it, or is not installed."""
    open3d = find_spec("open3d")
    if sys.platform != "linux" or open3d is None or open3d.origin is None:
        return None
    with contextlib.suppress(OSError):
        ctypes.CDLL(LIBUSB)
        return None  # the system has it
    with contextlib.suppress(ImportError, OSError):
        import libusb_package

        link = Path(open3d.origin).parent / LIBUSB
        if not link.exists() and (library := libusb_package.get_library_path()):
            return link, library
    return None


if __name__ == "__main__":
    try:
        made = link_libusb()
    except InputError as error:
        sys.exit(f"derain: {error}")
    print(f"Linked {made}" if made else f"Open3D needs no link to {LIBUSB} here")
