"""Small made-up data sets in the layouts of the real ones."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from recorded_scenes import write_wads

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

WriteScan = Callable[..., None]


@pytest.fixture
def write_labelled() -> WriteScan:
    """Writes a scan of 300 points and its labels: the drops are ``rain``, all else is class 0."""

    def write(scan: Path, label: Path, rain: int) -> None:
        scan.parent.mkdir(parents=True, exist_ok=True)
        scene(300, seed=sum(scan.name.encode())).tofile(scan)
        write_labels(label, np.repeat([0, rain], [270, 30]))

    return write


@pytest.fixture
def wads(tmp_path) -> list[str]:
    """Options for a data set in the layout of WADS, of three sequences of one scan each.

    Nothing is drawn of a training.
    """
    root = write_wads(tmp_path / "WADS", "00", "01", "02")
    split = '{train: ["00"], validation: ["01"], test: ["02"]}'
    return [
        *("--config", "outdet_wads.yaml", "--data.root", str(root), "--data.split", split),
        *("--data.loading.workers", "0", "--trainer.enable_progress_bar", "false"),
        *("--panels.scans", "0"),
    ]


@pytest.fixture
def refused(run_derain) -> Callable[..., str]:
    """Runs a command that is refused with exit code 2 before it prints anything; gives the line."""

    def run(*arguments: str | Path) -> str:
        outcome = run_derain(*arguments)
        assert (outcome.code, outcome.out) == (2, "")
        (line,) = outcome.err.splitlines()
        assert line.startswith("derain: ")
        return line

    return run


@pytest.fixture
def succeed(run_derain) -> Callable[..., Any]:
    """Runs a command that ends with exit code 0; gives its outcome."""

    def run(*arguments: str | Path) -> Any:
        outcome = run_derain(*arguments)
        assert outcome.code == 0, outcome.err
        return outcome

    return run


@pytest.fixture
def facts_of(succeed) -> Callable[..., dict[str, Any]]:
    """What `derain info` prints as JSON of the standard: without NaN and infinity."""

    def refuse(constant: str) -> None:
        raise ValueError(constant)

    def facts(*arguments: str | Path) -> dict[str, Any]:
        text = succeed("info", *arguments, "--json").out
        return json.loads(text, parse_constant=refuse)

    return facts
