"""A virtual environment of its own, as a new user's machine has one."""

import json
import os
import subprocess
import sys
from pathlib import Path

# What every environment begins with, which is nobody's dependency.
TOOLS = ("pip", "setuptools", "wheel")


class Environment:
    """A virtual environment with nothing in it but pip.

    Args:
        folder: Where it is made.
        python: The Python that it is of; by default this one's.
    """

    def __init__(self, folder: Path, python: str = sys.executable) -> None:
        subprocess.run([python, "-m", "venv", folder], check=True)
        self.folder = folder
        self.programs = folder / ("Scripts" if os.name == "nt" else "bin")
        self.python = self.programs / "python"

    def install(self, *requirements: str | Path) -> None:
        """Installs by pip, from the registry where pip is not set otherwise.

        Raises:
            subprocess.CalledProcessError: pip could not.
        """
        self.run(self.python, "-m", "pip", "install", "--quiet", *requirements)

    def run(self, program: str | Path, *arguments: str | Path, cwd: Path | None = None) -> str:
        """Runs a program, and returns its output.

        Args:
            program: A path, or the name of one of the environment's own programs.
            arguments: Its arguments.
            cwd: Folder that it runs in; by default the environment's, where no source code lies.

        Raises:
            subprocess.CalledProcessError: It failed; what it printed is on stderr.
        """
        return subprocess.run(
            [self.programs / program, *arguments],
            cwd=cwd or self.folder,
            env={name: value for name, value in os.environ.items() if name != "PYTHONPATH"},
            stdout=subprocess.PIPE,
            text=True,
            check=True,
        ).stdout

    def packages(self) -> dict[str, str]:
        """Installed packages besides the tools, by name, and their versions."""
        found = json.loads(self.run(self.python, "-m", "pip", "list", "--format", "json"))
        return {one["name"]: one["version"] for one in found if one["name"] not in TOOLS}

    def megabytes(self) -> float:
        """Size of the files of these packages, in MB of 10^6 bytes."""
        (packages,) = self.folder.glob("lib/python*/site-packages")
        return sum(_size(entry) for entry in packages.iterdir() if not _is_tool(entry)) / 1e6


def _size(path: Path) -> int:
    files = path.rglob("*") if path.is_dir() else [path]
    return sum(file.stat().st_size for file in files if file.is_file())


def _is_tool(entry: Path) -> bool:
    own = (*TOOLS, "pkg_resources", "_distutils_hack", "distutils-precedence.pth")
    return entry.name in own or entry.name.startswith(tuple(f"{tool}-" for tool in TOOLS))
