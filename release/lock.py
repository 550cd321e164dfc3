"""Writes constraints.txt again: the exact version of every package that `make` installs.

    make lock

pip resolves all extras and dependency groups of pyproject.toml for the lowest Python that derain
supports, and installs none. torch stays at the version that constraints.txt names: to raise it,
change that line first.
"""

import json
import subprocess
import sys
import tempfile
import tomllib
from collections.abc import Iterable
from pathlib import Path
from typing import Any

from packaging.utils import canonicalize_name

from derain.errors import InputError
from derain.files.atomic import write_text

REPOSITORY = Path(__file__).resolve().parent.parent
CONSTRAINTS = REPOSITORY / "constraints.txt"

# What `make` installs, in all of its targets; pip and setuptools install the others.
WANTED = ("pip", "setuptools", "--group", "dev", "--editable", ".[all,docs,openvino]")

HEADER = """\
# Every install step uses this file (`pip install -c constraints.txt`), so that everyone has what
# was tested. `make lock` writes it; torch stays as it is here, and is never a CUDA build of several
# gigabytes brought in by a range.
"""


def lowest_python() -> str:
    """The lowest version of Python that pyproject.toml admits, such as ``3.11``."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["project"]
    lowest: str = project["requires-python"].removeprefix(">=")
    return lowest


def resolved(torch: str) -> list[dict[str, Any]]:
    """The packages that pip would install in an empty environment, by its installation report.

    Args:
        torch: Requirement of torch.

    Raises:
        InputError: This is another Python than the lowest one: it needs other packages.
        subprocess.CalledProcessError: pip failed; its reason is on stderr.
    """
    lowest = lowest_python()
    if sys.version_info[:2] != tuple(map(int, lowest.split("."))):
        raise InputError(
            "Python", f"the lock is made by Python {lowest}", "Run it in an environment of that."
        )
    with tempfile.TemporaryDirectory() as folder:
        constraint = Path(folder) / "torch.txt"
        constraint.write_text(torch, "utf-8")
        command = [sys.executable, "-m", "pip", "install", "--quiet", "--dry-run", "--report", "-"]
        command += ["--constraint", str(constraint), *WANTED]
        # pip resolves for another micro version of Python only into a folder, and without building.
        command += ["--python-version", lowest, "--target", folder, "--only-binary", ":all:"]
        finished = subprocess.run(command, cwd=REPOSITORY, stdout=subprocess.PIPE, check=True)
    packages: list[dict[str, Any]] = json.loads(finished.stdout)["install"]
    return packages


def locked(packages: Iterable[dict[str, Any]]) -> list[str]:
    """A line ``name==version`` for each package but derain, in the order of their names.

    A local version, such as the ``+cpu`` of torch, is left out: it names one build of several.

    Args:
        packages: As :func:`resolved` returns them.
    """
    found = [package["metadata"] for package in packages]
    versions = {canonicalize_name(one["name"]): one["version"].partition("+")[0] for one in found}
    return [f"{name}=={versions[name]}" for name in sorted(versions) if name != "derain"]


def main() -> None:
    """Writes the file."""
    lines = CONSTRAINTS.read_text("utf-8").splitlines()
    torch = next(line for line in lines if line.startswith("torch=="))
    packages = locked(resolved(torch))
    write_text(CONSTRAINTS, HEADER + "\n".join(packages) + "\n")
    print(f"{CONSTRAINTS.name}: {len(packages)} packages")


if __name__ == "__main__":
    main()
