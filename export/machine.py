"""The machine and the software that times are taken on."""

import platform
from pathlib import Path

import numpy as np
import onnxruntime

import derain


def versions() -> str:
    """The processor, and the versions that a time depends on."""
    return (
        f"{processor()}; derain {derain.__version__}, onnxruntime {onnxruntime.__version__}, "
        f"NumPy {np.__version__}, Python {platform.python_version()}"
    )


def processor() -> str:
    """Name of the processor, as far as the system tells."""
    try:
        lines = Path("/proc/cpuinfo").read_text(encoding="utf-8").splitlines()
    except OSError:
        lines = []
    names = [line.split(":", 1)[1].strip() for line in lines if line.startswith("model name")]
    return names[0] if names else platform.processor() or platform.machine()
