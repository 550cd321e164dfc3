"""What an extra brings is said in one line wherever it is missing."""

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
def nothing_installed(monkeypatch: pytest.MonkeyPatch) -> None:
    for extra in EXTRAS:
        monkeypatch.setitem(sys.modules, extra.library, None)


@pytest.mark.parametrize("extra", EXTRAS, ids=lambda extra: extra.library)
def test_a_library_is_in_the_extra_that_is_said_to_bring_it(extra: Extra) -> None:
    providers = importlib.metadata.packages_distributions().get(extra.library, [extra.library])
    for name in (extra.name, *extra.also):
        asked_for = PROJECT["optional-dependencies"][name]
        names = {re.split(r"[^\w.-]", requirement)[0].lower() for requirement in asked_for}
        assert names & {provider.lower() for provider in providers}


def test_plain_derain_brings_no_library_of_an_extra() -> None:
    plain = {re.split(r"[^\w.-]", requirement)[0] for requirement in PROJECT["dependencies"]}
    assert plain == {"numpy", "onnxruntime", "small-gicp", "pyyaml", "tqdm", "python-neo-lzf"}


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize("extra", EXTRAS, ids=lambda extra: extra.library)
def test_what_is_missing_is_named_with_what_brings_it(extra: Extra) -> None:
    assert not extra.installed
    line = (
        f"export: needs {extra.library}, which is not installed. pip install 'derain[{extra.name}]'"
    )
    with pytest.raises(MissingExtraError) as of_require:
        require("export", extra)
    with pytest.raises(MissingExtraError) as of_load:
        extra.load("export")
    assert str(of_require.value) == str(of_load.value) == line
    assert of_load.value.name == extra.library


@pytest.mark.usefixtures("nothing_installed")
def test_several_are_named_at_once_and_each_once() -> None:
    with pytest.raises(MissingExtraError) as refusal:
        require("demo", TORCH, ONNX, OPEN3D, TORCH)
    assert str(refusal.value) == (
        "demo: needs torch, onnx and open3d, which are not installed. "
        "pip install 'derain[train,scene]'"
    )


@pytest.mark.usefixtures("nothing_installed")
@pytest.mark.parametrize(
    ("libraries", "extras"),
    [
        ([MATPLOTLIB], "view"),
        ([OPEN3D, MATPLOTLIB], "scene,view"),
        ([MATPLOTLIB, TORCH], "train"),
    ],
)
def test_the_smallest_extra_that_does_is_named(libraries: list[Extra], extras: str) -> None:
    with pytest.raises(MissingExtraError, match=re.escape(f"'derain[{extras}]'")):
        require("view", *libraries)


def test_what_is_installed_is_not_refused_and_not_imported() -> None:
    there = Extra("las", "json.tool")
    sys.modules.pop("json.tool", None)
    require("anything", there)
    assert "json.tool" not in sys.modules
    assert there.load("anything").__name__ == "json.tool"


def test_it_is_both_what_a_user_can_mend_and_what_an_import_raises() -> None:
    with pytest.raises(MissingExtraError) as refusal:
        require("a", Extra("las", "derain_lacks_this"))
    error = refusal.value
    assert isinstance(error, InputError)
    assert isinstance(error, ImportError)
    assert str(pickle.loads(pickle.dumps(error))) == str(error)  # it crosses to other processes


def test_a_library_that_is_there_and_broken_is_not_called_missing(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "derain_broken.py").write_text("import derain_lacks_this")
    monkeypatch.syspath_prepend(str(tmp_path))
    with pytest.raises(InputError, match=r"cannot be imported.*derain_lacks_this") as refusal:
        Extra("las", "derain_broken").load("a.las")
    assert not isinstance(refusal.value, MissingExtraError)


@pytest.mark.usefixtures("nothing_installed")
def test_an_import_that_failed_is_told_if_an_extra_would_mend_it() -> None:
    with pytest.raises(ModuleNotFoundError) as failure:
        import matplotlib.figure  # noqa: F401
    missing = missing_extra("view", failure.value)
    assert missing is not None
    assert str(missing).startswith(f"view: needs {MATPLOTLIB.library}, which is not installed")
    assert missing_extra("view", ModuleNotFoundError("no", name="of_somebody_else")) is None
    assert missing_extra("view", ModuleNotFoundError("no")) is None


def test_a_part_that_an_installed_library_lacks_is_no_missing_extra() -> None:
    assert missing_extra("view", ModuleNotFoundError("no", name="matplotlib.nothing")) is None
