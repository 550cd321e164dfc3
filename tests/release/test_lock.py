"""constraints.txt locks all that pyproject.toml asks for, on any machine."""

import tomllib
from collections.abc import Iterator

import pytest
from packaging.requirements import Requirement
from packaging.utils import canonicalize_name

from release.lock import CONSTRAINTS, REPOSITORY, locked

PYPROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))


@pytest.fixture(scope="module")
def lock() -> dict[str, str]:
    """Version by name."""
    lines = CONSTRAINTS.read_text("utf-8").splitlines()
    pairs = [line.split("==") for line in lines if not line.startswith("#")]
    return dict(pairs)


def wanted() -> Iterator[Requirement]:
    """What pyproject.toml names in all of its lists, where this system needs it."""
    project, groups = PYPROJECT["project"], PYPROJECT["dependency-groups"]
    lists = [project["dependencies"], *project["optional-dependencies"].values(), *groups.values()]
    for requirement in (Requirement(one) for each in lists for one in each if isinstance(one, str)):
        needed = requirement.marker is None or requirement.marker.evaluate()
        if needed and requirement.name != "derain":
            yield requirement


@pytest.mark.parametrize("requirement", [*wanted()], ids=lambda requirement: requirement.name)
def test_what_is_asked_for_has_a_version_that_is_admitted(requirement, lock) -> None:
    assert lock[canonicalize_name(requirement.name)] in requirement.specifier


def test_there_is_one_build_of_torch_and_no_library_of_cuda(lock) -> None:
    assert "torch" in lock
    assert not [version for version in lock.values() if "+" in version]
    assert not [name for name in lock if name.startswith(("nvidia", "cuda", "triton"))]


def test_a_lock_lists_what_pip_reports_but_derain() -> None:
    reported = {"torch": "2.13.0+cpu", "Ruamel.Yaml": "0.19.1", "derain": "0.2.0"}
    packages = [{"metadata": {"name": n, "version": v}} for n, v in reported.items()]
    assert locked(packages) == ["ruamel-yaml==0.19.1", "torch==2.13.0"]
