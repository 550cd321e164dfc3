"""Builds and runs the example in C++."""

import re
import subprocess
from collections.abc import Callable
from pathlib import Path

SOURCE = Path(__file__).resolve().parents[2] / "examples" / "cpp"

# A program that takes arguments.
Program = Callable[..., subprocess.CompletedProcess[str]]


def build(folder: Path) -> None:
    """Builds it into a folder, with onnxruntime where CMake finds it."""
    # Less optimised it is compiled in half the time, and computes the same.
    options = ["-DCMAKE_CXX_FLAGS=-Werror", "-DCMAKE_CXX_FLAGS_RELEASE=-O1"]
    for command in (["-S", SOURCE, "-B", folder, *options], ["--build", folder, "-j2"]):
        subprocess.run(["cmake", *command], check=True, capture_output=True)


def program(path: Path) -> Program:
    """A program that was built."""

    def run(*arguments: str | Path) -> subprocess.CompletedProcess[str]:
        done = subprocess.run([path, *arguments], capture_output=True, text=True)
        # Debian's onnxruntime prints at its start that it knows every operator twice.
        done.stderr = re.sub(r"Schema error: .*\n\n?", "", done.stderr)
        return done

    return run
