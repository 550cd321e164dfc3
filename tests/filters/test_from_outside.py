"""A filter of another package, in one file, has every command that derain's own have."""

import json
import os
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

FILTER = Path(__file__).with_name("haze.py")

# Runs commands of derain in one process, and prints the exit code and the output of each.
COMMANDS = """
import contextlib, io, json, sys
from derain.cli.main import main

outcomes = []
for arguments in json.loads(sys.argv[1]):
    out, err = io.StringIO(), io.StringIO()
    with contextlib.redirect_stdout(out), contextlib.redirect_stderr(err):
        try:
            code = main(arguments)
        except SystemExit as leaving:
            code = leaving.code
    outcomes.append((code, out.getvalue(), err.getvalue()))
print(json.dumps(outcomes))
"""


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder of packages in which one brings the filter, as an installation leaves it."""
    folder = tmp_path / "packages"
    about = folder / "haze_for_derain-1.0.dist-info"
    about.mkdir(parents=True)
    shutil.copy(FILTER, folder / "haze_for_derain.py")
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: haze-for-derain\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[derain.filters]\nhaze = haze_for_derain\n")
    return folder


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder of two scans with their labels beside it; 30 points of each are snow."""
    for number in range(2):
        path = tmp_path / f"velodyne/{number}.bin"
        path.parent.mkdir(exist_ok=True)
        scene(300, number).tofile(path)
        label = tmp_path / f"labels/{number}.label"
        label.parent.mkdir(exist_ok=True)
        write_labels(label, np.where(np.arange(300) >= 270, 110, 0))
    return tmp_path / "velodyne"


def run(packages: Path, code: str, *commands: list[object]) -> list[tuple[int, str, str]]:
    """Exit codes and outputs of commands, in a process that finds those packages as well."""
    finished = subprocess.run(
        [sys.executable, "-c", code, json.dumps(commands, default=str)],
        env={**os.environ, "PYTHONPATH": str(packages)},
        capture_output=True,
        text=True,
    )
    assert finished.returncode == 0, finished.stderr
    return [tuple(outcome) for outcome in json.loads(finished.stdout.splitlines()[-1])]


def haze(
    points: NDArray[np.float32], neighbours: int = 2, reach: float = 30.0, spacing: float = 0.5
) -> list[bool]:
    """The filter's definition, worked out from all pairs of points."""
    xyz = points[:, :3].astype(np.float64)
    apart = np.sort(np.linalg.norm(xyz[:, None] - xyz[None], axis=2), axis=1)
    near = np.linalg.norm(xyz, axis=1) < reach
    rain: list[bool] = (near & (apart[:, neighbours - 1] > spacing)).tolist()
    return rain


def rain_in(folder: Path, number: int = 0) -> list[bool]:
    return np.fromfile(folder / f"{number}.label", "<u4").astype(bool).tolist()


def test_an_installed_filter_is_run_tuned_benched_drawn_and_listed(
    installed: Path, scans: Path, tmp_path: Path
) -> None:
    best, labelled = tmp_path / "best.yaml", ["--data", scans, "--card", "wads"]
    bench = ["--methods", "haze", f"tuned={best}", "--timed", "1", "--repeats", "1"]
    outcomes = run(
        installed,
        COMMANDS,
        ["run", "haze", scans, "--out", tmp_path / "plain"],
        ["run", "haze", scans, "--out", tmp_path / "set", "--set", "spacing=2.5"],
        ["run", "haze", scans, "--out", tmp_path / "none", "--set", "reach=0.5"],
        ["tune", "haze", *labelled, "--trials", "6", "--out", best],
        ["run", best, scans, "--out", tmp_path / "tuned"],
        ["bench", *labelled, *bench, "--out", tmp_path / "bench"],
        ["view", scans / "0.bin", "--methods", "haze", "--out", tmp_path / "view.png"],
        *([command, "--help"] for command in ("run", "tune", "bench", "view")),
        ["run", "hazy", scans, "--out", tmp_path / "no"],
        ["run", "haze", scans, "--out", tmp_path / "no", "--set", "reach=-1"],
    )
    plain, set_, none, tune, tuned, benched, view, *helps, unknown, senseless = outcomes
    for code, _, err in (plain, set_, none, tune, tuned, benched, view, *helps):
        assert code == 0, err
    points = [scene(300, number) for number in range(2)]
    assert [rain_in(tmp_path / "plain", number) for number in range(2)] == list(map(haze, points))
    assert 0 < sum(rain_in(tmp_path / "plain")) < 300
    assert rain_in(tmp_path / "set") == haze(points[0], spacing=2.5)
    assert none[2].splitlines() == [
        f"derain: warning: {scans / '0.bin'}: no point is nearer than 0.5 m",
        "derain: warning: 1 more scan: nothing near",
    ]
    parameters = yaml.safe_load(best.read_text())
    assert parameters.pop("method") == "haze"
    assert rain_in(tmp_path / "tuned") == haze(points[0], **parameters)
    rows = json.loads((tmp_path / "bench/bench.json").read_text())["rows"]
    assert [row["method"] for row in rows] == ["haze", "tuned"]
    assert all(row["ms"] > 0 for row in rows)  # each timed in a process of its own
    found = np.concatenate([haze(each) for each in points])
    snow = np.tile(np.arange(300) >= 270, 2)
    assert rows[0]["iou"] == np.count_nonzero(found & snow) / np.count_nonzero(found | snow)
    for _, out, _ in helps:
        assert "\n  haze  rain is near the sensor and has no other point near it\n" in out
    assert unknown[0] == senseless[0] == 2
    assert "or one of default, crf, dror, dsor, haze, ror, sor, ssr, persistence" in unknown[2]
    assert "haze: reach is -1. Give a finite number" in senseless[2]


def test_a_filter_that_a_program_imports_is_a_method_of_that_program(
    scans: Path, tmp_path: Path
) -> None:
    command = ["run", "haze", scans, "--out", tmp_path / "out"]
    unknown, known = (
        run(FILTER.parent, f"{imports}\n{COMMANDS}", command)[0] for imports in ("", "import haze")
    )
    assert unknown[0] == 2
    assert "haze: no such file. Give a model written by" in unknown[2]
    assert known[0] == 0
    assert rain_in(tmp_path / "out") == haze(scene(300, 0))


def test_a_package_that_is_broken_keeps_no_filter_of_derain_from_use(
    installed: Path, scans: Path, tmp_path: Path
) -> None:
    (installed / "haze_for_derain.py").write_text("import nothing_of_this_name")
    own, foreign, help_ = run(
        installed,
        COMMANDS,
        ["run", "dror", scans, "--out", tmp_path / "out", "--most-removed", "1"],
        ["run", "haze", scans, "--out", tmp_path / "no"],
        ["run", "--help"],
    )
    assert own[0] == 0
    assert "haze" not in own[2]  # there was no need to look at other packages
    warning, refusal = foreign[2].splitlines()
    assert warning == (
        "derain: warning: derain.filters: haze: haze_for_derain cannot be imported "
        "(ModuleNotFoundError: No module named 'nothing_of_this_name'). Repair or uninstall the "
        "package haze-for-derain."
    )
    assert refusal.startswith("derain: haze: no such file.")
    assert help_[0] == 0
    assert "\n  dror  rain has few points within" in help_[1]
