"""Builds derain's wheel and source distribution, and proves both away from the repository.

    python -m release.build --out dist              build, compare, install and run
    python -m release.build --out dist --no-install    without the registry: build and compare
    python -m release.build --out dist --tag v0.2.0    only where that is the tag of this version

Both are built from a copy of the files that git knows, so that nothing of a working tree gets in.
The source distribution is unpacked and must build a wheel of the same files; the wheel is then
installed in an environment of its own, and run.
"""

import argparse
import shutil
import subprocess
import sys
import tarfile
import tempfile
from pathlib import Path
from zipfile import ZipFile

from derain import __version__
from derain.errors import InputError
from release.environment import Environment

REPOSITORY = Path(__file__).resolve().parent.parent

# Builds in the folder it runs in, by the build system that is installed here: no registry.
BUILD = "import sys; from setuptools import build_meta; build_meta.build_{kind}(sys.argv[1])"


def copy_of_sources(folder: Path) -> Path:
    """Copies the files that git knows, as they are in the working tree, and nothing else."""
    listed = subprocess.run(
        ["git", "ls-files", "-z"], cwd=REPOSITORY, stdout=subprocess.PIPE, check=True
    ).stdout.decode()
    for name in filter(None, listed.split("\0")):
        if (REPOSITORY / name).is_file():
            (folder / name).parent.mkdir(parents=True, exist_ok=True)
            shutil.copy2(REPOSITORY / name, folder / name)
    return folder


def built(kind: str, sources: Path, out: Path) -> Path:
    """Builds ``wheel`` or ``sdist`` of sources, and returns the file.

    Raises:
        InputError: The build failed; what it printed is on stderr.
    """
    before = set(out.glob("*"))
    command = [sys.executable, "-c", BUILD.format(kind=kind), out.resolve()]
    finished = subprocess.run(command, cwd=sources, capture_output=True, text=True)
    if finished.returncode:
        print(finished.stderr, file=sys.stderr)
        raise InputError(kind, "cannot be built, for the reason above", "Mend pyproject.toml.")
    (made,) = set(out.glob("*")) - before
    return made


def content_of(wheel: Path) -> dict[str, bytes]:
    """Every file of a wheel, by its name."""
    with ZipFile(wheel) as archive:
        return {name: archive.read(name) for name in archive.namelist()}


def build(out: Path) -> list[Path]:
    """Builds the wheel and the source distribution, and a second wheel from the latter.

    Args:
        out: Folder for both, made if missing; former ones of the same version are replaced.

    Returns:
        The wheel and the source distribution.

    Raises:
        InputError: A build failed, or the two wheels differ.
    """
    with tempfile.TemporaryDirectory() as name:
        work = Path(name)
        first, second, unpacked = (work / part for part in ("first", "second", "unpacked"))
        for folder in (first, second):
            folder.mkdir()
        sdist = built("sdist", copy_of_sources(work / "of_sdist"), first)
        wheel = built("wheel", copy_of_sources(work / "of_wheel"), first)
        with tarfile.open(sdist) as archive:
            archive.extractall(unpacked)
        (sources,) = unpacked.iterdir()
        refuse_difference(content_of(wheel), content_of(built("wheel", sources, second)))
        out.mkdir(parents=True, exist_ok=True)
        return [Path(shutil.copy2(file, out)) for file in (wheel, sdist)]


def refuse_difference(ours: dict[str, bytes], theirs: dict[str, bytes]) -> None:
    """Refuses a source distribution that builds another wheel than the repository does.

    Raises:
        InputError: A file that only one of them has, or that differs.
    """
    names = sorted(ours.keys() | theirs.keys())
    different = [name for name in names if ours.get(name) != theirs.get(name)]
    if different:
        raise InputError(
            "sdist",
            f"its wheel differs from the repository's in {', '.join(different)}",
            "Name what is missing in MANIFEST.in, or among the package data of pyproject.toml.",
        )


def prove(wheel: Path, folder: Path) -> str:
    """Installs a wheel in a new environment, runs it there, and returns its output."""
    environment = Environment(folder)
    environment.install(wheel.resolve())
    environment.run(environment.python, "-m", "pip", "check")
    version = environment.run("derain", "--version")
    card = environment.run("derain", "info", "default")
    return version + card.splitlines()[0]


def refuse_other_tag(tag: str) -> None:
    """Refuses a tag that names another version than derain's own.

    Raises:
        InputError: It is not ``v`` and the version.
    """
    own = f"v{__version__}"
    if tag != own:
        raise InputError(
            tag, f"is not the tag of this version, {own}", f"Tag {own}, or raise the version first."
        )


def main() -> None:
    """Builds, compares, installs and runs."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("--out", type=Path, default=Path("dist"), help="(default: %(default)s)")
    parser.add_argument("--install", action=argparse.BooleanOptionalAction, default=True)
    parser.add_argument("--tag", help="tag of the release")
    arguments = parser.parse_args()
    if arguments.tag is not None:
        refuse_other_tag(arguments.tag)
    wheel, sdist = build(arguments.out)
    for file in (wheel, sdist):
        print(f"{file}: {file.stat().st_size:,} bytes")
    print("The source distribution builds the same wheel.")
    if arguments.install:
        with tempfile.TemporaryDirectory() as folder:
            print(prove(wheel, Path(folder) / "environment"))


if __name__ == "__main__":
    main()
