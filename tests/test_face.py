"""What ``import derain`` offers: when it is loaded, what it is, and that its examples are true."""

import ast
import doctest
import pickle
import pydoc
import re
import subprocess
import sys
from importlib import import_module
from pathlib import Path
from pkgutil import iter_modules

import numpy as np
import pytest
import torch
from lightning import Trainer

import derain
import derain.datamodules
from derain.datamodules.base import ScanDataModule
from derain.models.registry import NETWORKS
from derain.workflows.training import choices

from .folder_of_examples import prepare

REPOSITORY = Path(__file__).resolve().parent.parent
STUB = REPOSITORY / "derain" / "__init__.pyi"
OFFERED = [name for name in derain.__all__ if name != "__version__"]

# What an example may use without an import, besides what its module has.
NAMES = {"derain": derain, "np": np, "torch": torch, "Trainer": Trainer}


def run(code: str) -> subprocess.CompletedProcess[str]:
    """Runs Python code in a process that has loaded nothing yet."""
    return subprocess.run([sys.executable, "-c", code], capture_output=True, text=True)


def test_the_table_is_every_import_of_the_type_stub() -> None:
    body = ast.parse(STUB.read_text("utf-8")).body
    imports = [node for node in body if isinstance(node, ast.Import | ast.ImportFrom)]
    assert [alias.asname for node in imports for alias in node.names] == OFFERED
    assert len(set(OFFERED)) == len(OFFERED) > 20


def test_every_network_is_offered() -> None:
    own = {network.__name__ for network in NETWORKS.values() if _is_of_derain(network)}
    assert len(own) > 3
    assert own <= {*OFFERED}


def test_every_data_module_is_offered_and_known_to_configurations() -> None:
    modules = {module.name for module in iter_modules(derain.datamodules.__path__)}
    for name in modules:
        import_module(f"derain.datamodules.{name}")
    kinds = _subclasses(ScanDataModule)
    concrete = {kind for kind in kinds if not kind.__name__.endswith("DataModule")}
    assert {kind.__name__ for kind in concrete} <= {*OFFERED}
    assert {*choices()["data"]} == concrete - {derain.InMemory}  # which no file can hold


def _subclasses(kind: type) -> set[type]:
    """Derain's own classes below a class."""
    below = kind.__subclasses__()
    deeper = {each for one in below for each in _subclasses(one)}
    return {one for one in below if _is_of_derain(one)} | deeper


def _is_of_derain(kind: type) -> bool:
    return kind.__module__.startswith("derain.")


def test_no_name_is_that_of_a_module_which_would_take_its_place_once_loaded() -> None:
    modules = {module.name for module in iter_modules(derain.__path__)}
    assert not modules & set(OFFERED)


@pytest.mark.parametrize("name", OFFERED)
def test_a_name_gives_what_it_is_called_by_and_is_found_without_asking_again(name) -> None:
    value = getattr(derain, name)
    assert value.__name__ == name
    assert vars(derain)[name] is value
    assert pickle.loads(pickle.dumps(value)) is value


def test_everything_is_listed_before_anything_is_loaded() -> None:
    code = "import sys, derain; print(*dir(derain)); assert 'derain.scan' not in sys.modules"
    finished = run(code)
    assert finished.returncode == 0, finished.stderr
    assert set(finished.stdout.split()) >= set(derain.__all__)


def test_a_wrong_name_is_refused_as_python_does_it_with_the_name_that_was_meant() -> None:
    with pytest.raises(AttributeError, match=r"^module 'derain' has no attribute 'Derainr'$"):
        derain.Derainr  # noqa: B018
    assert "Did you mean: 'Derainer'?" in run("import derain; derain.Derainr").stderr
    assert "Did you mean" not in run("import derain; derain.xylophone").stderr


def test_help_shows_every_name_and_what_it_is() -> None:
    text = pydoc.plain(pydoc.render_doc(derain))
    assert "takes the rain out of LiDAR" in text
    assert not [name for name in OFFERED if not re.search(rf"\b{name}\b", text)]
    assert "Calls a point rain if it has few points around it." in text  # of a filter's own help


@pytest.mark.parametrize("name", OFFERED)
def test_every_name_has_an_example_which_is_true(here, monkeypatch, name) -> None:
    prepare(here)
    # Where rich is installed, as with import-linter, Lightning prints a table of every model.
    connector = "lightning.pytorch.trainer.connectors.callback_connector"
    monkeypatch.setattr(f"{connector}._RICH_AVAILABLE", False)
    documented = getattr(derain, name)
    own_names = vars(sys.modules[documented.__module__])
    tests = doctest.DocTestFinder().find(documented, name, globs={**own_names, **NAMES})
    assert [test for test in tests if test.name == name and test.examples]
    runner = doctest.DocTestRunner(verbose=False)
    printed: list[str] = []
    with torch.random.fork_rng(devices=[]):
        for test in tests:
            runner.run(test, out=printed.append)
    assert not runner.failures, "".join(printed)
