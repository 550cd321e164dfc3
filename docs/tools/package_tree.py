"""Shows mkdocstrings the package as it installs: the top-level folders as sub-packages of derain.

    python -m docs.tools.package_tree

Makes a folder of links, ``build/docs/derain``, in which each package lies where setuptools puts it;
mkdocs.yml names that folder to mkdocstrings.
"""

import shutil
import tomllib
from pathlib import Path

REPOSITORY = Path(__file__).resolve().parents[2]
TREE = REPOSITORY / "build" / "docs"


def main() -> None:
    """Makes the links again."""
    shutil.rmtree(TREE, ignore_errors=True)
    package = TREE / "derain"
    package.mkdir(parents=True)
    for part in (REPOSITORY / "derain").iterdir():
        (package / part.name).symlink_to(part)
    for folder, name in _moved_packages().items():
        (package / name).symlink_to(REPOSITORY / folder)


def _moved_packages() -> dict[str, str]:
    """Sub-packages of derain that lie elsewhere in the repository: their name there, by folder."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))
    moved = project["tool"]["setuptools"]["package-dir"].items()
    names = {folder: package.removeprefix("derain.") for package, folder in moved}
    # What lies within another one comes with it.
    return {folder: name for folder, name in names.items() if "." not in name}


if __name__ == "__main__":
    main()
