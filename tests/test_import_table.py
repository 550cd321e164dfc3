"""Places import from those above them in CONTRIBUTING.md's table, and nothing heavy unasked."""

import ast
import re
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import pytest

REPOSITORY = Path(__file__).resolve().parent.parent
PACKAGING = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]

# What the table calls libraries. Open3D is reached through one module, which stands for it.
LIBRARIES = {
    "torch": "PyTorch",
    "torchmetrics": "PyTorch",
    "lightning": "Lightning",
    "jsonargparse": "Lightning",
    "open3d": "Open3D",
    "derain.system.open3d_import": "Open3D",
    "matplotlib": "matplotlib",
    "onnx": "ONNX",
    "onnxscript": "ONNX",
    "openvino": "OpenVINO",
    "optuna": "Optuna",
    "sqlalchemy": "Optuna",
    "rerun": "Rerun",
}
# What every room may import.
LIGHT = {
    *("numpy", "yaml", "tqdm", "small_gicp", "onnxruntime"),
    *("lzf", "flatbuffers", "libusb_package", "mcap", "_typeshed"),
}

# Modules that run on a small computer, and those that all others are made of.
LIGHT_MODULES = re.compile(
    r"derain(\.(files|filters|cards|views)(\..*)?|\.(scan|spec|errors|evaluation.counts)"
    r"|\.export\.(runtime|methods|timing)|\.cli\.(main|run|info))?"
)


def folder_of(package: str) -> Path:
    return REPOSITORY / PACKAGING["package-dir"].get(package, package.replace(".", "/"))


@cache
def modules() -> dict[str, Path]:
    """Every module of the package, by its name."""
    return {
        package if file.stem == "__init__" else f"{package}.{file.stem}": file
        for package in PACKAGING["packages"]
        for file in folder_of(package).glob("*.py")
    }


@cache
def table() -> dict[str, set[str]]:
    """Heavy libraries of each place, from the place that imports no other to the topmost."""
    text = (REPOSITORY / "CONTRIBUTING.md").read_text("utf-8")
    rows = re.findall(r"^\| (`[^|]+`) \|.*\|([^|]*)\|$", text, re.MULTILINE)
    return {
        place: set(filter(None, libraries.strip().split(", ")))
        for places, libraries in rows
        for place in re.findall(r"`([\w/.]+)`", places)
    }


def place_of(module: str) -> str:
    """The folder of a module, or its file where that has a row of its own."""
    path = modules()[module].relative_to(REPOSITORY).as_posix()
    return max((place for place in table() if path.startswith(place)), key=len)


def imported(node: ast.AST, at_once: bool) -> Iterator[str]:
    """Full names of what a piece of a module imports; only of what it does when it is loaded."""
    if at_once and isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        return
    if at_once and isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert not node.level, "imports are by full names"
        yield from (f"{node.module}.{alias.name}" for alias in node.names)
    for child in ast.iter_child_nodes(node):
        yield from imported(child, at_once)


@cache
def imports_of(module: str, at_once: bool = False) -> set[str]:
    """Modules of derain, and names of other libraries, that a module imports."""
    names = imported(ast.parse(modules()[module].read_text("utf-8")), at_once)
    return {resolved(name) for name in names} - sys.stdlib_module_names


def resolved(name: str) -> str:
    if not name.startswith("derain"):
        return name.split(".")[0]
    while name not in modules():
        name = name.rpartition(".")[0]
    return name


def test_the_table_names_a_place_for_every_module_and_no_other() -> None:
    assert {place_of(module) for module in modules()} == set(table())
    assert len(modules()) > 200


@pytest.mark.parametrize("place", table())
def test_a_place_imports_from_those_above_it_alone(place: str) -> None:
    height = {name: number for number, name in enumerate(table())}
    wrong = {
        (module, name)
        for module in modules()
        if place_of(module) == place
        for name in imports_of(module) & modules().keys()
        if height[place_of(name)] > height[place]
    }
    assert not wrong


@pytest.mark.parametrize("place", table())
def test_a_place_imports_the_heavy_libraries_of_its_row_and_all_of_them(place: str) -> None:
    of_modules = [imports_of(module) for module in modules() if place_of(module) == place]
    names = set().union(*of_modules) - (modules().keys() - LIBRARIES.keys()) - LIGHT
    assert {LIBRARIES.get(name, name) for name in names} == table()[place]


def test_no_module_is_loaded_to_load_itself() -> None:
    graph = {name: imports_of(name, at_once=True) - {name} for name in modules()}
    TopologicalSorter(graph).prepare()  # raises CycleError and names the circle


def reached_from(module: str) -> set[str]:
    """What is loaded with a module, at least."""
    seen, ahead = set(), {module}
    while ahead:
        seen |= ahead
        ahead = {name for at in ahead & modules().keys() for name in imports_of(at, True)} - seen
    return seen


def test_what_is_to_be_light_reaches_nothing_heavy() -> None:
    light = [module for module in modules() if LIGHT_MODULES.fullmatch(module)]
    heavy = {module: reached_from(module) - modules().keys() - LIGHT for module in light}
    assert not {module: reached for module, reached in heavy.items() if reached}
    # What is heavy is seen.
    assert reached_from("derain.evaluation.metrics") >= {"torch", "torchmetrics"}
