"""What runs on a small computer loads no more than it needs, and no module needs itself."""

import ast
import json
import re
import subprocess
import sys
import tomllib
from collections.abc import Iterator
from functools import cache
from graphlib import TopologicalSorter
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

HEAVY = {
    "torch",
    "torchmetrics",
    "lightning",
    "pytorch_lightning",
    "open3d",
    "matplotlib",
    "scipy",
    "optuna",
}

REPOSITORY = Path(__file__).resolve().parent.parent
PACKAGING = tomllib.loads((REPOSITORY / "pyproject.toml").read_text("utf-8"))["tool"]["setuptools"]

# Modules that run on a small computer, and those that all others are made of.
LIGHT_MODULES = re.compile(
    r"derain(\.(files|filters|cards|views)(\..*)?|\.(scan|spec|errors|evaluation.counts)"
    r"|\.export\.(runtime|methods|timing)|\.cli\.(main|run|info))?"
)
# The libraries that they may load.
LIGHT = {"numpy", "yaml", "tqdm", "small_gicp", "onnxruntime", "lzf", "flatbuffers", "mcap"}

# Runs its first argument, then prints the packages that this loaded: those of the start, which an
# editable installation or a profiler may add to, are not its doing.
LOADED_BY = """
import json, sys
before = set(sys.modules)
try:
    exec(sys.argv.pop(1))
finally:
    loaded = {name.split(".")[0] for name in set(sys.modules) - before}
    print(json.dumps(sorted(loaded - sys.stdlib_module_names)))
"""

COMMAND = "from derain.cli.main import main; main(sys.argv[1:])"
COMMANDS = """
import json
from derain.cli.main import main
assert not any(main(command) for command in json.loads(sys.argv[1]))
"""

# A random network, or a filter on a made-up scan, calls most of it rain.
ALL = ("--most-removed", "1")


def loaded_by(code: str, *arguments: str | Path) -> set[str]:
    """Top-level packages outside the standard library that some code loads."""
    finished = subprocess.run(
        [sys.executable, "-c", LOADED_BY, code, *arguments], capture_output=True, text=True
    )
    assert finished.returncode == 0, finished.stderr
    loaded = json.loads(finished.stdout.splitlines()[-1])
    return {name for name in loaded if "cython" not in name}  # which YAML is compiled with


@pytest.fixture
def scan(tmp_path) -> Path:
    path = tmp_path / "scan.bin"
    scene(100).tofile(path)
    return path


@pytest.mark.parametrize(
    ("used", "loaded"),
    [
        ("Scan, derain.InputError", {"derain", "numpy"}),
        ("read_scan, derain.write_scan", {"derain", "numpy"}),
        ("FilterDerainer, derain.DROR", {"derain", "numpy", "small_gicp", "yaml"}),
        ("load_card, derain.DataCard", {"derain", "numpy", "yaml"}),
        ("Derainer", {"derain", "numpy", "yaml"}),
    ],
)
def test_a_name_of_the_package_loads_what_it_needs(used, loaded) -> None:
    assert loaded_by(f"import derain; derain.{used}") == loaded


def test_a_model_needs_onnxruntime_and_the_library_of_neighbours(onnx_model) -> None:
    loaded = loaded_by("import derain; derain.Derainer(sys.argv[1])", onnx_model)
    assert loaded == {"derain", "numpy", "yaml", "onnxruntime", "small_gicp"}


@pytest.mark.parametrize("option", ["--help", "--version"])
def test_a_start_without_a_command_loads_no_library(option) -> None:
    assert loaded_by(COMMAND, option) == {"derain"}


def test_what_a_small_computer_runs_loads_nothing_heavy(
    scan, onnx_model, salsanext_onnx, tmp_path
) -> None:
    methods, out = (str(onnx_model), str(salsanext_onnx), "dror"), tmp_path / "out"
    commands = [
        ["info", str(scan), str(onnx_model), str(salsanext_onnx)],
        ["info", str(scan.parent)],
        ["info", "--grid", str(scan)],
        ["odometry", str(scan), "--out", str(tmp_path / "poses.txt")],
        *(["run", method, str(scan), "--out", str(out), *ALL] for method in methods),
    ]
    assert not loaded_by(COMMANDS, json.dumps(commands)) & HEAVY
    assert (out / "scan.label").stat().st_size == 400


def test_help_loads_nothing_heavy() -> None:
    loaded = loaded_by(COMMAND, "run", "--help")
    assert "derain" in loaded
    assert not loaded & (HEAVY | {"onnxruntime", "openvino"})


def test_a_picture_loads_no_more_than_the_drawing_and_the_method_need(
    scan, onnx_model, tmp_path
) -> None:
    write_labels(scan.with_suffix(".label"), np.repeat([0, 110], 50))
    methods = ["--methods", onnx_model, "dror", "all", "--card", "wads"]
    loaded = loaded_by(COMMAND, "view", scan, *methods, "--out", tmp_path / "out.png")
    assert loaded & HEAVY == {"matplotlib"}


@cache
def modules() -> dict[str, Path]:
    """Every module of the package, by its name."""
    return {
        package if file.stem == "__init__" else f"{package}.{file.stem}": file
        for package in PACKAGING["packages"]
        for file in folder_of(package).glob("*.py")
    }


def folder_of(package: str) -> Path:
    return REPOSITORY / PACKAGING["package-dir"].get(package, package.replace(".", "/"))


@cache
def imports_of(module: str) -> set[str]:
    """Modules of derain, and names of other libraries, that are loaded with a module."""
    names = imported(ast.parse(modules()[module].read_text("utf-8")))
    return {resolved(name) for name in names} - sys.stdlib_module_names


def imported(node: ast.AST) -> Iterator[str]:
    """Full names of what a piece of a module imports when it is loaded."""
    if isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef):
        return
    if isinstance(node, ast.If) and ast.unparse(node.test) == "TYPE_CHECKING":
        return
    if isinstance(node, ast.Import):
        yield from (alias.name for alias in node.names)
    elif isinstance(node, ast.ImportFrom):
        assert not node.level, "imports are by full names"
        yield from (f"{node.module}.{alias.name}" for alias in node.names)
    for child in ast.iter_child_nodes(node):
        yield from imported(child)


def resolved(name: str) -> str:
    if not name.startswith("derain"):
        return name.split(".")[0]
    while name not in modules():
        name = name.rpartition(".")[0]
    return name


def reached_from(module: str) -> set[str]:
    """What is loaded with a module, at least."""
    seen, ahead = set(), {module}
    while ahead:
        seen |= ahead
        ahead = {name for at in ahead & modules().keys() for name in imports_of(at)} - seen
    return seen


def test_no_module_is_loaded_to_load_itself() -> None:
    graph = {name: imports_of(name) - {name} for name in modules()}
    assert len(graph) > 200
    TopologicalSorter(graph).prepare()  # raises CycleError and names the circle


def test_what_is_to_be_light_reaches_nothing_heavy() -> None:
    light = [module for module in modules() if LIGHT_MODULES.fullmatch(module)]
    heavy = {module: reached_from(module) - modules().keys() - LIGHT for module in light}
    assert not {module: reached for module, reached in heavy.items() if reached}
    assert "open3d" not in reached_from("derain.simulation.dataset")  # only to cast
    # What is heavy is seen.
    assert reached_from("derain.evaluation.metrics") >= {"torch", "torchmetrics"}
