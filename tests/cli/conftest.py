"""Small made-up data sets in the layouts of the real ones."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

WriteScan = Callable[..., None]


@pytest.fixture
def write_labelled() -> WriteScan:
    """Writes a scan of 300 points and its labels: the drops are ``rain``, all else is class 0."""

    def write(scan: Path, label: Path, rain: int) -> None:
        points = scene(300, seed=sum(scan.name.encode()))
        scan.parent.mkdir(parents=True, exist_ok=True)
        points.tofile(scan)
        drops = np.arange(300) >= 270
        write_labels(label, np.where(drops, rain, 0))

    return write


@pytest.fixture
def wads(tmp_path: Path, write_labelled: WriteScan) -> list[str]:
    """Options for a data set in the layout of WADS, of three sequences of one scan each.

    Nothing is drawn of a training.
    """
    root = tmp_path / "WADS"
    for sequence in ("00", "01", "02"):
        folder = root / "sequences" / sequence
        write_labelled(folder / "velodyne/0.bin", folder / "labels/0.label", rain=110)
    split = '{train: ["00"], validation: ["01"], test: ["02"]}'
    return [
        *("--config", "outdet_wads.yaml", "--data.root", str(root), "--data.split", split),
        *("--data.loading.workers", "0", "--trainer.enable_progress_bar", "false"),
        *("--panels.scans", "0", "--errors.pictures", "0"),
    ]
