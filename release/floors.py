"""The lowest version of each dependency that pyproject.toml admits, as constraints for pip.

    python -m release.floors > floors.txt                 those of plain derain
    python -m release.floors train feather > floors.txt    and of some extras
    pip install -c floors.txt .

An installation with these constraints shows whether the floors are true.
"""

import sys
import tomllib
from collections.abc import Iterable, Iterator
from pathlib import Path

from packaging.requirements import Requirement

PYPROJECT = Path(__file__).resolve().parent.parent / "pyproject.toml"


def floors(extras: Iterable[str] = ()) -> list[str]:
    """One line ``name==version`` a dependency, those of this system alone.

    Args:
        extras: Names of extras whose dependencies are wanted too.

    Raises:
        KeyError: No such extra.
    """
    project = tomllib.loads(PYPROJECT.read_text("utf-8"))["project"]
    lines = (
        f"{requirement.name}=={bound.version}"
        for requirement in _requirements(project, extras)
        for bound in requirement.specifier
        if bound.operator == ">=" and (requirement.marker is None or requirement.marker.evaluate())
    )
    return list(dict.fromkeys(lines))  # two extras may bring the same


def _requirements(project: dict[str, object], extras: Iterable[str]) -> Iterator[Requirement]:
    """Those of derain and of extras, of which one may be made of others."""
    dependencies, of_extras = project["dependencies"], project["optional-dependencies"]
    assert isinstance(dependencies, list)
    assert isinstance(of_extras, dict)
    yield from map(Requirement, dependencies)
    ahead, seen = [*extras], set()
    while ahead:
        extra = ahead.pop(0)
        if extra in seen:
            continue
        seen.add(extra)
        for requirement in map(Requirement, of_extras[extra]):
            if requirement.name == project["name"]:
                ahead += sorted(requirement.extras)
            else:
                yield requirement


if __name__ == "__main__":
    print(*floors(sys.argv[1:]), sep="\n")
