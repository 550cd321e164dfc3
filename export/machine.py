"""The machine and the software that times are taken on."""

import platform
from collections.abc import Iterable
from importlib.metadata import PackageNotFoundError, version
from pathlib import Path

import numpy as np

import derain
from derain.export.runtimes.session import DEFAULT_RUNTIME, RUNTIMES


def versions(runtimes: Iterable[str] = (DEFAULT_RUNTIME,)) -> str:
    """The processor, and the versions that a time depends on.

    Args:
        runtimes: Names of what ran networks.
    """
    packages = dict.fromkeys(RUNTIMES[name].PACKAGE for name in runtimes)
    ran = "".join(f"{_with_version(package)}, " for package in packages)
    return (
        f"{processor()}; derain {derain.__version__}, {ran}"
        f"NumPy {np.__version__}, Python {platform.python_version()}"
    )


def _with_version(package: str) -> str:
    """A package with its version, as far as it is installed under that name."""
    try:
        return f"{package} {version(package)}"
    except PackageNotFoundError:  # another brings the same modules, as onnxruntime-gpu does
        return package


def processor() -> str:
    """Name of the processor, as far as it is known."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
