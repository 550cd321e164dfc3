"""A filter of another package, in one file, has every command that derain's own have."""

import json
import os
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
import yaml
from numpy.typing import NDArray

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

HAZE = """
from dataclasses import dataclass

import numpy as np
from derain.filters import FILTERS, PointFilter
from derain.views.scan_issues import ScanIssue


@FILTERS.add("haze")
@dataclass(frozen=True)
class Haze(PointFilter):
    HELP = "rain is near the sensor and has no other point near it"
    SPACE = {"neighbours": (2, 20), "reach": (1.0, 100.0)}

    neighbours: int = 2
    reach: float = 30.0
    spacing: float = 0.5

    def judge(self, view):
        near = np.linalg.norm(view.points[:, :3], axis=1) < self.reach
        return near & (view.distances[:, self.neighbours - 1] > self.spacing)

    def issues(self, scan):
        if not (scan.range[scan.valid] < self.reach).any():
            yield ScanIssue("nothing near", f"no point is nearer than {self.reach:g} m")
"""

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
    (folder / "haze_for_derain.py").write_text(HAZE)
    (about / "METADATA").write_text("Metadata-Version: 2.1\nName: haze-for-derain\nVersion: 1.0\n")
    (about / "entry_points.txt").write_text("[derain.filters]\nhaze = haze_for_derain\n")
    return folder


def haze(
    points: NDArray[np.float32], neighbours: int = 2, reach: float = 30.0, spacing: float = 0.5
) -> list[bool]:
    """The filter's definition, worked out from all pairs of points."""
    xyz = points[:, :3].astype(np.float64)
    apart = np.sort(np.linalg.norm(xyz[:, None] - xyz[None], axis=2), axis=1)
    near = np.linalg.norm(xyz, axis=1) < reach
    rain: list[bool] = (near & (apart[:, neighbours - 1] > spacing)).tolist()
    return rain


def test_an_installed_filter_is_run_tuned_benched_and_listed(
    installed: Path, tmp_path: Path
) -> None:
    points = scene(300)
    scan, best = tmp_path / "0.bin", tmp_path / "best.yaml"
    points.tofile(scan)
    write_labels(tmp_path / "0.label", np.where(np.arange(300) >= 270, 110, 0))
    labelled = ["--data", scan, "--card", "wads"]
    commands = [
        ["run", "haze", scan, "--out", tmp_path / "set", "--set", "spacing=2.5"],
        ["run", "haze", scan, "--out", tmp_path / "none", "--set", "reach=0.5"],
        ["tune", "haze", *labelled, "--trials", "6", "--out", best],
        ["run", best, scan, "--out", tmp_path / "tuned"],
        ["bench", *labelled, "--methods", "haze", "--repeats", "1", "--out", tmp_path / "bench"],
        ["run", "--help"],
    ]
    finished = subprocess.run(
        [sys.executable, "-c", COMMANDS, json.dumps(commands, default=str)],
        env={**os.environ, "PYTHONPATH": str(installed)},
        capture_output=True,
        text=True,
    )
    assert finished.returncode == 0, finished.stderr
    outcomes = json.loads(finished.stdout.splitlines()[-1])
    assert [code for code, _, _ in outcomes] == [0] * len(commands), outcomes

    def rain_in(folder: str) -> list[bool]:
        return np.fromfile(tmp_path / folder / "0.label", "<u4").astype(bool).tolist()

    assert rain_in("set") == haze(points, spacing=2.5)
    assert "no point is nearer than 0.5 m" in outcomes[1][2]
    parameters = yaml.safe_load(best.read_text())
    assert parameters.pop("method") == "haze"
    assert rain_in("tuned") == haze(points, **parameters)
    (row,) = json.loads((tmp_path / "bench/bench.json").read_text())["rows"]
    assert row["ms"] > 0  # timed in a process of its own
    found, snow = np.array(haze(points)), np.arange(300) >= 270
    assert row["iou"] == np.count_nonzero(found & snow) / np.count_nonzero(found | snow)
    assert "\n  haze  rain is near the sensor and has no other point near it\n" in outcomes[-1][1]
