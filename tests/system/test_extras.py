"""A missing extra is named in one line wherever it is needed."""

import importlib.metadata
import pickle
import re
import sys
import tomllib
from pathlib import Path

import pytest

from derain.errors import InputError
from derain.system.extras import (
    EXTRAS,
    MATPLOTLIB,
    ONNX,
    OPEN3D,
    TORCH,
    Extra,
    MissingExtraError,
    missing_extra,
    require,
)

PROJECT = tomllib.loads(
    (Path(__file__).resolve().parents[2] / "pyproject.toml").read_text("utf-8")
)["project"]


@pytest.fixture
def nothing_installed(monkeypatch) -> None:
    for extra in EXTRAS:
        monkeypatch.setitem(sys.modules, extra.library, None)


def test_a_library_is_in_the_extra_that_is_named_for_it() -> None:
    distributions = importlib.metadata.packages_distributions()
    for extra in EXTRAS:
        providers = {each.lower() for each in distributions.get(extra.library, [extra.library])}
        required = requirements(PROJECT["optional-dependencies"][extra.name])
        assert providers & required, extra.library


def test_what_training_draws_with_comes_with_its_extra() -> None:
    assert MATPLOTLIB.library in requirements(PROJECT["optional-dependencies"][TORCH.name])


def test_plain_derain_brings_no_library_of_an_extra() -> None:
    assert requirements(PROJECT["dependencies"]) == {
        *("numpy", "onnxruntime", "small-gicp", "pyyaml", "tqdm", "python-neo-lzf")
    }


def requirements(lines: list[str]) -> set[str]:
    """Names of the packages that lines of the project's file ask for."""
    return {re.split(r"[^\w.-]", line)[0].lower() for line in lines}


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize(
    ("libraries", "reason", "extras"),
    [
        *(([extra], f"{extra.library}, which is not", extra.name) for extra in EXTRAS),
        ([TORCH, ONNX, OPEN3D, TORCH], "torch, onnx and open3d, which are not", "train,scene"),
        ([OPEN3D, MATPLOTLIB], "open3d and matplotlib, which are not", "scene,view"),
    ],
)
def test_what_is_missing_is_named_with_the_smallest_extras_that_bring_it(
    libraries, reason, extras
) -> None:
    with pytest.raises(MissingExtraError) as refusal:
        require("demo", *libraries)
    line = f"demo: needs {reason} installed. pip install 'derain[{extras}]'"
    assert str(refusal.value) == line
    with pytest.raises(MissingExtraError) as of_load:
        libraries[0].load("demo")
    assert of_load.value.name == libraries[0].library
    assert len(libraries) > 1 or str(of_load.value) == line
    # An InputError and an ImportError, which crosses to other processes.
    assert isinstance(refusal.value, InputError)
    assert isinstance(refusal.value, ImportError)
    assert str(pickle.loads(pickle.dumps(refusal.value))) == line


def test_what_is_installed_is_not_refused_and_not_imported() -> None:
    there = Extra("feather", "json.tool")
    sys.modules.pop("json.tool", None)
    require("anything", there)
    assert "json.tool" not in sys.modules
    assert there.load("anything").__name__ == "json.tool"


def test_a_library_that_is_there_and_broken_is_not_called_missing(tmp_path, monkeypatch) -> None:
    (tmp_path / "derain_broken.py").write_text("import derain_lacks_this")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r"cannot be imported.*derain_lacks_this") as refusal:
        Extra("feather", "derain_broken").load("a.feather")
    assert not isinstance(refusal.value, MissingExtraError)


def test_ctrl_c_in_an_import_is_not_called_a_broken_library(tmp_path, monkeypatch) -> None:
    code = "raise ImportError('initialization failed') from KeyboardInterrupt()"
    (tmp_path / "derain_interrupted.py").write_text(code)
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(KeyboardInterrupt):
        Extra("feather", "derain_interrupted").load("a.feather")


def test_an_import_that_failed_names_the_extra_that_would_mend_it(request) -> None:
    of_a_part = ModuleNotFoundError("no", name="matplotlib.nothing")
    assert missing_extra("view", of_a_part) is None  # the library itself is installed
    request.getfixturevalue("nothing_installed")
    line = str(missing_extra("view", of_a_part))
    assert line.startswith(f"view: needs {MATPLOTLIB.library}, which is not installed")
    for name in ("of_somebody_else", None):
        assert missing_extra("view", ModuleNotFoundError("no", name=name)) is None
