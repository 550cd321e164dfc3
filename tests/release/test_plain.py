"""What plain ``pip install derain`` can do, with none of the libraries that extras bring.

Commands run in processes that find no other libraries than those of a plain installation.
"""

import json
import os
import subprocess
import sys
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.cli.main import COMMANDS, TRAINING
from derain.default import default_model
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

# Python imports this in every process whose path it is on, also in those that a bench starts.
PLAIN = """
import sys
from importlib.machinery import PathFinder

FOUND = {
    *sys.stdlib_module_names,
    *("derain", "numpy", "onnxruntime", "small_gicp", "yaml", "_yaml", "tqdm", "lzf"),
    *("flatbuffers", "google", "packaging"),  # onnxruntime's own
}

class PlainFinder(PathFinder):
    @classmethod
    def find_spec(cls, name, path=None, target=None):
        found = name.partition(".")[0] in FOUND or name.startswith("_sysconfigdata")
        return super().find_spec(name, path, target) if found else None

sys.meta_path[:] = [PlainFinder if finder is PathFinder else finder for finder in sys.meta_path]
"""

# Runs commands one after the other, and prints what came of each.
COMMANDS_IN_TURN = """
import contextlib, io, json, sys
from derain.cli.main import main
for command in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(command)
        except SystemExit as leaving:
            code = leaving.code
    print(json.dumps([code, out.getvalue(), err.getvalue()]), file=sys.__stdout__)
"""


@pytest.fixture
def plain(tmp_path) -> Any:
    """Runs code in a process of a plain installation, and gives what it prints."""
    folder = tmp_path / "plain"
    folder.mkdir()
    (folder / "sitecustomize.py").write_text(PLAIN)

    def run(code: str, *arguments: str) -> str:
        finished = subprocess.run(
            [sys.executable, "-c", code, *arguments],
            cwd=tmp_path,
            env={**os.environ, "PYTHONPATH": str(folder)},
            capture_output=True,
            text=True,
        )
        assert finished.returncode == 0, finished.stderr
        return finished.stdout

    return run


@pytest.fixture
def scan(tmp_path) -> Path:
    path = tmp_path / "scan.bin"
    scene(200).tofile(path)
    write_labels(path.with_suffix(".label"), np.repeat([0, 110], 100))
    return path


def outcomes(plain: Any, *commands: list[str]) -> list[tuple[int, str, str]]:
    """Exit code, output and errors of commands."""
    printed = plain(COMMANDS_IN_TURN, json.dumps(commands))
    return [tuple(json.loads(line)) for line in printed.splitlines()]


def test_the_process_finds_what_plain_derain_brings_and_nothing_else(plain) -> None:
    code = (
        "import numpy, onnxruntime, small_gicp, yaml, tqdm, lzf\n"
        "from derain.system.extras import EXTRAS\n"
        "print(*(extra.library for extra in EXTRAS if extra.installed))"
    )
    assert plain(code).split() == ["flatbuffers"]


def test_every_command_has_its_help(plain) -> None:
    names = [*COMMANDS, *TRAINING]
    for name, (code, out, err) in zip(
        names, outcomes(plain, *([name, "--help"] for name in names)), strict=True
    ):
        assert (code, err) == (0, ""), name
        assert f"usage: derain {name}" in out.replace("-c ", "derain ")


def test_scans_are_cleaned_looked_at_and_labelled(plain, scan) -> None:
    tried = [
        ["run", str(scan), "--out", "cleaned"],
        ["run", "dror", str(scan), "--out", "by_dror", "--most-removed", "1"],
        ["info", "default", str(scan), str(scan.with_suffix(".label")), str(default_model())],
        ["info", str(scan.parent)],
        ["info", "--grid", str(scan)],
        ["info", "--formats"],
        ["teach", "dror", str(scan), "--out", "taught"],
        ["odometry", str(scan), "--out", "poses.txt"],
    ]
    for command, (code, _, err) in zip(tried, outcomes(plain, *tried), strict=True):
        assert code in (0, None), (command, err)
    assert (scan.parent / "cleaned/scan.label").stat().st_size == 4 * 200


def test_methods_are_compared_and_the_missing_picture_is_mentioned(plain, scan) -> None:
    bench = ["bench", "--data", str(scan), "--card", "wads", "--methods"]
    bench += ["default", "dror", "position", "all", "--train", str(scan)]
    bench += ["--timed", "1", "--repeats", "1", "--out", "bench"]
    (scan.parent / "bench").mkdir()
    (scan.parent / "bench/speed_error.png").touch()  # of an earlier bench
    ((code, out, err),) = outcomes(plain, bench)
    assert code == 0, err
    assert "dror" in out
    assert "(!)" not in out, "a method failed"
    written = {file.name for file in (scan.parent / "bench").iterdir()}
    assert written == {"bench.md", "bench.csv", "bench.json"}
    assert "speed_error.png: needs matplotlib, which is not installed" in err
    assert "pip install 'derain[view]'" in err


def test_a_command_names_its_missing_extra_in_one_line_before_any_work(plain, scan) -> None:
    given, checkpoint = str(scan), str(default_model().with_suffix(".ckpt"))
    arrow, bag = (scan.with_suffix(suffix) for suffix in (".feather", ".bag"))
    for file in (arrow, bag):
        file.write_bytes(b"anything")
    labelled = ["--data", given, "--card", "wads"]
    tried = {
        ("export", checkpoint, "--out", "model.onnx"): ("torch", "train"),
        ("import-weights", "outdet", given, "--stats", "wads", "--out", "o.ckpt"): (
            "torch",
            "train",
        ),
        ("info", checkpoint): ("torch", "train"),
        ("info", str(scan.parent), "--picture", "out.png"): ("matplotlib", "view"),
        ("view", given, "--out", "out.png"): ("matplotlib", "view"),
        ("view", given, "--window"): ("open3d", "view,scene"),
        ("view", given, "--rerun", "out.rrd"): ("rerun", "view"),
        ("tune", "dror", *labelled, "--out", "out.yaml"): ("optuna", "train"),
        ("learn", given, "--out", "out.onnx"): ("lightning", "train"),
        ("fit", "--config", "outdet_wads.yaml"): ("jsonargparse", "train"),
        ("test", "--config", "outdet_wads.yaml"): ("torch", "train"),
        ("simulate", "--out", "out"): ("open3d", "scene"),
        ("simulate", "--on", given, "--rain", "9", "--out", "out", "--picture"): (
            *("matplotlib", "view"),
        ),
        ("annotate", given, "--scene", "scene.yaml", "--out", "out"): ("open3d", "scene,view"),
        ("demo", "--out", "out"): ("optuna", "train,scene"),
        ("run", given, "--out", "out", "--runtime", "openvino"): ("openvino", "openvino"),
        ("info", str(arrow)): ("pyarrow", "feather"),
        ("info", str(bag)): ("rosbags", "ros"),
    }
    before = {*scan.parent.iterdir()}
    found = outcomes(plain, *map(list, tried))
    for command, (library, extra), (code, out, err) in zip(
        tried, tried.values(), found, strict=True
    ):
        assert (code, out) == (2, ""), (command, err)
        (line,) = err.splitlines()
        assert line.startswith("derain: ")
        assert library in line, command
        assert line.rstrip(".").endswith(f"installed. pip install 'derain[{extra}]'"), command
    assert {*scan.parent.iterdir()} == before


def test_an_import_that_no_command_saw_coming_is_reported_too(plain) -> None:
    code = (
        "import sys\n"
        "from derain.cli import main\n"
        "def fails(arguments): import matplotlib.figure\n"
        "main.module_of('info').main = fails\n"
        "sys.stderr = sys.stdout\n"
        "print(main.main(['info', 'x']))"
    )
    line, exit_code = plain(code).splitlines()
    assert line == (
        "derain: info: needs matplotlib, which is not installed. pip install 'derain[view]'"
    )
    assert exit_code == "2"


def test_an_attribute_names_the_extra_that_brings_it(plain) -> None:
    code = (
        "import derain, pydoc\n"
        "for name in ('Wads', 'OutDet'):\n"
        "    assert name not in dir(derain)\n"
        "    try:\n        getattr(derain, name)\n"
        "    except ImportError as error:\n        print(error)\n"
        "from derain import *\n"
        "assert Scan is derain.Scan and 'Wads' not in globals()\n"
        "assert 'FilterDerainer' in pydoc.plain(pydoc.render_doc(derain))\n"
        "print(derain.Derainer().spec.network)"
    )
    wads, outdet, network = plain(code).splitlines()
    for line in (wads, outdet):
        assert line.endswith("which is not installed. pip install 'derain[train]'")
    assert wads.startswith("derain.Wads: needs ")
    assert network == "cues"
