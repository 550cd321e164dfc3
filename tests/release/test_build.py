"""Wheel and source distribution hold what derain needs, and run away from the repository."""

import os
import subprocess
import sys
import tarfile
import tomllib
from pathlib import Path
from zipfile import ZipFile

import pytest
import yaml

from derain import __version__
from derain.errors import InputError
from release.build import REPOSITORY, build, content_of, refuse_difference, refuse_other_tag

PYPROJECT = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))
SETUPTOOLS = PYPROJECT["tool"]["setuptools"]


@pytest.fixture(scope="module")
def distributions(tmp_path_factory) -> tuple[Path, Path]:
    """The wheel and the source distribution, which has built the same wheel."""
    wheel, sdist = build(tmp_path_factory.mktemp("dist"))
    return wheel, sdist


@pytest.fixture(scope="module")
def wheel(distributions) -> Path:
    return distributions[0]


def test_their_names_hold_the_one_version(distributions) -> None:
    wheel, sdist = distributions
    assert wheel.name == f"derain-{__version__}-py3-none-any.whl"
    assert sdist.name == f"derain-{__version__}.tar.gz"


def test_the_citation_names_the_version_and_the_address_of_pyproject() -> None:
    citation = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text("utf-8"))
    assert citation["version"] == __version__
    assert citation["repository-code"] == PYPROJECT["project"]["urls"]["Repository"]


def test_the_wheel_holds_every_file_of_the_packages_and_no_other(wheel) -> None:
    listed = subprocess.run(["git", "ls-files"], cwd=REPOSITORY, capture_output=True, text=True)
    folders = {"derain": "derain", **SETUPTOOLS["package-dir"]}
    expected = set()
    for name in listed.stdout.splitlines():
        for package, folder in folders.items():
            if name.startswith(f"{folder}/") and (REPOSITORY / name).is_file():
                expected.add(f"{package.replace('.', '/')}/{name.removeprefix(f'{folder}/')}")
    held = {name for name in content_of(wheel) if ".dist-info/" not in name}
    assert held == expected
    assert {"derain/py.typed", "derain/default/model.onnx", "derain/cards/wads.yaml"} < held


def test_the_source_distribution_holds_what_its_readers_want(distributions) -> None:
    with tarfile.open(distributions[1]) as archive:
        held = {name.partition("/")[2] for name in archive.getnames()}
    assert held >= {"README.md", "LICENSE", "CHANGELOG.md", "CITATION.cff", "SECURITY.md"}


def test_the_wheel_alone_runs_away_from_the_repository(wheel, tmp_path) -> None:
    with ZipFile(wheel) as archive:
        archive.extractall(tmp_path / "installed")
    code = "import derain, sys; from derain.cli.main import main; print(derain.__file__); main()"
    printed = [
        subprocess.run(
            [sys.executable, "-c", code, *command],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(tmp_path / "installed")},
            capture_output=True,
            text=True,
        )
        for command in (["--version"], ["info", "default"])
    ]
    for finished in printed:
        assert finished.stdout.startswith(str(tmp_path / "installed")), finished.stderr
    assert printed[0].stdout.endswith(f"derain {__version__}\n")
    assert "default, version" in printed[1].stdout


def test_a_file_that_the_source_distribution_lacks_is_named() -> None:
    with pytest.raises(InputError, match=r"differs .* in derain/default/model.onnx, derain/x\.py"):
        refuse_difference(
            {"derain/default/model.onnx": b"1", "derain/x.py": b"1", "derain/y.py": b""},
            {"derain/x.py": b"2", "derain/y.py": b""},
        )


@pytest.mark.parametrize("tag", ["v0.0.0", __version__, f"v{__version__}.1", ""])
def test_a_tag_of_another_version_is_refused(tag) -> None:
    refuse_other_tag(f"v{__version__}")
    with pytest.raises(InputError, match=f"v{__version__}"):
        refuse_other_tag(tag)
