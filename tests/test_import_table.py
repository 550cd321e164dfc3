"""Rooms import what CONTRIBUTING.md's table says, and what is to be light reaches nothing heavy."""

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
    "optuna": "Optuna",
    "sqlalchemy": "Optuna",
}
# What every room may import.
LIGHT = {
    *("numpy", "yaml", "tqdm", "small_gicp", "onnxruntime"),
    *("lzf", "flatbuffers", "libusb_package"),
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
    """Rooms and libraries that a room may import, by the room's folder."""
    text = (REPOSITORY / "CONTRIBUTING.md").read_text("utf-8")
    rows = re.findall(r"^\| `([\w/]+/)` \|.*\| (.*) \|$", text, re.MULTILINE)
    return {room: {item.strip("` ") for item in cell.split(",")} for room, cell in rows}


def room_of(file: Path) -> str:
    path = file.relative_to(REPOSITORY).as_posix()
    return max((room for room in table() if path.startswith(room)), key=len)


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


def arrows(module: str) -> set[str]:
    """Rooms and libraries that a module imports, its own room and light libraries left out."""
    found = set()
    for name in imports_of(module) - LIGHT:
        own_room = name in modules() and name not in LIBRARIES
        found.add(room_of(modules()[name]) if own_room else LIBRARIES.get(name, name))
    return found - {room_of(modules()[module])}


def test_the_table_names_every_folder_of_the_package() -> None:
    folders = {
        f"{folder_of(package).relative_to(REPOSITORY)}/" for package in PACKAGING["packages"]
    }
    assert folders == set(table()) - {"benchmarks/"}
    assert len(modules()) > 100


def modules_of(room: str) -> list[str]:
    return [module for module, file in modules().items() if room_of(file) == room]


@pytest.mark.parametrize("room", [room for room in table() if "everything" not in table()[room]])
def test_a_room_imports_what_the_table_says_and_all_of_it(room: str) -> None:
    by_module = {module: arrows(module) for module in modules_of(room)}
    assert not {m: found - table()[room] for m, found in by_module.items() if found - table()[room]}
    assert set().union(*by_module.values()) == table()[room] - {"nothing"}


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
    assert reached_from("derain.evaluation.scores") >= {"torch", "torchmetrics"}
