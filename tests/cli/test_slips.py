"""What goes wrong in the first ten minutes is one line: what, why, and what to do about it."""

import sys
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import torch

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.system.extras import OPTUNA


@pytest.fixture
def here(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    """A working folder with what a beginner has."""
    monkeypatch.chdir(tmp_path)
    for folder in ("scans", "empty", "mixed", "drive/velodyne", "drive/labels"):
        Path(folder).mkdir(parents=True)
    for name in ("scans/0.bin", "mixed/0.bin", "drive/velodyne/0.bin"):
        scene(50).tofile(name)
    write_labels(Path("drive/labels/0.label"), np.full(50, 110))  # falling snow of WADS
    Path("mixed/notes.txt").write_text("drove north\n")
    Path("heights.csv").write_text("x,y,height\n1,2,3\n")
    torch.save({"weight": torch.zeros(1)}, "weights.pt")
    Path("file").touch()


# A command, and what its line names: the subject, the reason and the remedy.
SLIPS = {
    "method misspelt": ("run drror scans --out out", "drror", "no such method", "dror?"),
    "no scans": ("run empty --out out", "empty", "no scans", "Name a folder"),
    "wrong card": (
        "bench --data drive --card semantickitti --methods dror --out out",
        *("drive/labels/0.label", "[110] are no classes of SemanticKITTI", "--card wads"),
    ),
    "weights of PyTorch": (
        "run weights.pt scans --out out",
        *("weights.pt", "not an ONNX model", "derain import-weights"),
    ),
    "a graphics card for `run`": ("run scans --out out --gpu", "--gpu", "no such option", "CPU"),
    "a graphics card for `fit`": (
        "fit --config outdet_wads.yaml --gpu",
        *("gpu", "no such option", "trainer.accelerator"),
    ),
    "labels elsewhere": (
        "bench --data scans --card wads --methods dror --out out",
        *("scans/0.bin", "labels/0.label", "layout: {scans: scans, labels: FOLDER}"),
    ),
    "missing extra": (
        "tune dror --data drive --card wads --out best.yaml",
        *("tune", "needs optuna", "pip install 'derain[train]'"),
    ),
    "output that cannot be written": (
        "run dror drive --out file/cleaned",
        *("file/cleaned", "cannot be written", "a folder that is writable"),
    ),
}


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(("command", "subject", "reason", "remedy"), SLIPS.values(), ids=SLIPS)
def test_a_slip_is_one_line_that_names_subject_reason_and_remedy(
    command: str,
    subject: str,
    reason: str,
    remedy: str,
    refused: Callable[..., str],
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, OPTUNA.library, None)
    line = refused(*command.split())
    named, _, rest = line.removeprefix("derain: ").partition(": ")
    assert named.endswith(subject)
    assert rest.index(reason) < rest.rindex(remedy)
    assert not [*Path("out").rglob("*")]


@pytest.mark.usefixtures("here")
@pytest.mark.parametrize(
    ("command", "code", "subject", "reason", "remedy"),
    [
        ("run dror mixed --out out", 0, "mixed", "1 .txt passed over", "name them"),
        ("run dror heights.csv --out out", 2, "heights.csv", "no x, y and z", "--columns"),
        ("run crf scans --columns x,y,z,_ --out out", 0, "scans/0.bin", "no intensity", "dror"),
    ],
    ids=["mixed files", "missing coordinates", "missing intensity"],
)
def test_what_is_odd_about_one_file_is_named_and_the_others_go_on(
    command: str,
    code: int,
    subject: str,
    reason: str,
    remedy: str,
    run_derain: Callable[..., object],
) -> None:
    outcome = run_derain(*command.split())
    assert outcome.code == code
    (line,) = [line for line in outcome.err.splitlines() if reason in line]
    assert subject in line.partition(reason)[0]
    assert remedy in line.partition(reason)[2]
