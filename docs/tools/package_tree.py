"""Shows mkdocstrings the package as it installs: the top-level folders as sub-packages of derain.

A hook of MkDocs: before a build it makes a folder of links, ``build/docs/derain``, in which each
package lies where pyproject.toml says that setuptools puts it.
"""

import shutil
import tomllib
from pathlib import Path

from mkdocs.config.defaults import MkDocsConfig
from mkdocs.plugins import event_priority

REPOSITORY = Path(__file__).resolve().parents[2]
TREE = REPOSITORY / "build" / "docs"


@event_priority(100)  # before mkdocstrings looks which of its folders there are
def on_config(config: MkDocsConfig) -> MkDocsConfig:
    """Makes the links anew; mkdocs.yml says where mkdocstrings finds them."""
    shutil.rmtree(TREE, ignore_errors=True)
    package = TREE / "derain"
    package.mkdir(parents=True)
    for part in (REPOSITORY / "derain").iterdir():
        (package / part.name).symlink_to(part)
    for folder, name in _moved_packages().items():
        (package / name).symlink_to(REPOSITORY / folder)
    return config


def _moved_packages() -> dict[str, str]:
    """Sub-packages of derain that lie elsewhere in the repository: their name there, by folder."""
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))
    moved = project["tool"]["setuptools"]["package-dir"].items()
    names = {folder: package.removeprefix("derain.") for package, folder in moved}
    # What lies within another one comes with it.
    return {folder: name for folder, name in names.items() if "." not in name}
