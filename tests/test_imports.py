"""What runs on a small computer loads no more than it needs."""

import json
import subprocess
import sys
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
