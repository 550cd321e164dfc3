"""Commands on data sets, sequences and trees: what is found, and what results are named by."""

import json
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.filters import DROR, FilterDerainer


@pytest.fixture
def root(tmp_path: Path) -> Path:
    """A data set of two sequences of two scans each; what lies beside them is damaged."""
    root = tmp_path / "data"
    for name in ("02", "11"):
        folder = root / "sequences" / name / "velodyne"
        folder.mkdir(parents=True)
        for number in range(2):
            scene(300, int(name) + number).tofile(folder / f"{number:06d}.bin")
        for record in ("poses.txt", "times.txt", "calib.txt"):
            (folder.parent / record).write_bytes(b"\xff damaged")
        (folder / "metadata.csv").write_bytes(b"\xff damaged")
    (root / "README.txt").write_text("of two sequences")
    return root


def names(folder: Path) -> list[str]:
    return sorted(str(path.relative_to(folder)) for path in folder.rglob("*") if path.is_file())


@pytest.mark.parametrize("part", ["", "sequences"])
def test_a_data_set_is_cleaned_into_folders_like_its_own(
    succeed, root: Path, tmp_path: Path, part: str
) -> None:
    out = tmp_path / "out"
    outcome = succeed("run", "dror", root / part, "--out", out, "--json")
    keys = [f"{name}/velodyne/00000{number}" for name in ("02", "11") for number in range(2)]
    scans = [json.loads(line)["scan"] for line in outcome.out.splitlines()]
    assert scans == [str(root / f"sequences/{key}.bin") for key in keys]
    assert names(out) == [f"{key}.{suffix}" for key in keys for suffix in ("bin", "label")]
    rain = FilterDerainer(DROR())(scene(300, 12))
    np.testing.assert_array_equal(np.fromfile(out / f"{keys[3]}.label", "<u4"), rain)
    assert (out / f"{keys[3]}.bin").read_bytes() == scene(300, 12)[~rain].tobytes()


def test_a_sequence_is_cleaned_into_plain_names(run_derain, root: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    assert run_derain("run", "dror", root / "sequences/11", "--out", out).code == 0
    assert names(out) == [f"00000{n}.{suffix}" for n in range(2) for suffix in ("bin", "label")]


def test_it_rains_on_a_data_set(succeed, root: Path, tmp_path: Path) -> None:
    out = tmp_path / "out"
    succeed("simulate", "--on", root, "--rain", "25", "--out", out, "--picture")
    assert {path.suffix for path in out.glob("*/velodyne/000001.*")} == {".bin", ".label", ".png"}
    assert len(names(out)) == 4 * 3


@pytest.mark.parametrize(
    "command",
    [
        ["run", "ror", "{scans}", "--out", "out"],
        ["simulate", "--on", "{scans}", "--rain", "5", "--out", "out"],
        ["info", "{scans}"],
        ["info", "{scans}/000000.bin"],
        ["info", "--grid", "{scans}"],
        ["view", "{scans}/000000.bin", "--methods", "ror", "--out", "out.png"],
        ["annotate", "{scans}", "--scene", "scene.yaml", "--out", "out", "--no-picture"],
    ],
    ids=lambda command: " ".join(command[:2]),
)
def test_damaged_records_break_no_command_that_asks_for_none(
    succeed, root: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, command: list[str]
) -> None:
    monkeypatch.chdir(tmp_path)
    Path("scene.yaml").write_text("road: [[2, -10], [60, -10], [60, 10], [2, 10]]")
    scans = str(root / "sequences/02/velodyne")
    succeed(*(word.format(scans=scans) for word in command))
