"""Imports Open3D, which wants a system library that a bare Debian lacks."""

import ctypes
import sys
from types import ModuleType

from derain.errors import InputError


def import_open3d() -> ModuleType:
    """Imports Open3D where it is needed; nothing else in derain imports it.

    On Linux, Open3D links against libusb-1.0.so.0. The wheel libusb-package carries that library
    under the same SONAME, so loading it first satisfies the dynamic linker.

    Returns:
        The module open3d.

    Raises:
        InputError: Open3D or a library it links against is missing.
    """
    try:
        if sys.platform == "linux":
            import libusb_package

            ctypes.CDLL(str(libusb_package.get_library_path()), ctypes.RTLD_GLOBAL)
        import open3d
    except (ImportError, OSError) as error:
        raise InputError(
            "open3d",
            f"cannot be imported ({error})",
            "Install derain's dependencies again with pip, or the system library it names.",
        ) from error
    module: ModuleType = open3d
    return module
