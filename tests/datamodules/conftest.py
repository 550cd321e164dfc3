"""What the tests of data modules share."""

from collections.abc import Callable, Sequence
from pathlib import Path
from typing import Any

import numpy as np
import pytest

from derain.datamodules.base import Loading, ScanDataModule
from derain.datamodules.folder import Folder
from derain.evaluation.hard_cases import scene
from derain.files import write_scan
from derain.files.labels import write_labels
from derain.learning.task import agree_on_task
from derain.models.base import DerainingModule
from derain.models.outdet import OutDet
from derain.scan import Float32s, Scan

Connect = Callable[..., ScanDataModule]


@pytest.fixture
def write() -> Callable[..., None]:
    """Writes a scan, by default of 50 points, and its labels, ids repeated over the points."""

    def write(
        scan: Path,
        labels: Path | None = None,
        ids: Sequence[int] = (0,),
        points: Float32s | None = None,
    ) -> None:
        points = scene(50) if points is None else points
        write_scan(scan, Scan.of(points))
        if labels is not None:
            write_labels(labels, np.resize(np.array(ids), len(points)))

    return write


@pytest.fixture
def connect() -> Connect:
    """Has a data module agree with a model, by default 3D-OutDet, as a trainer would."""

    def connect(
        data: ScanDataModule, neighbours: int = 9, model: DerainingModule | None = None
    ) -> ScanDataModule:
        agree_on_task(OutDet(neighbours=neighbours) if model is None else model, data)
        return data

    return connect


@pytest.fixture
def folder(tmp_path, write) -> Callable[..., Folder]:
    """Makes a data module of six scans of 40, 41, ... points, a third of them snow of WADS."""
    for number in range(6):
        file = tmp_path / f"{number}.bin"
        write(file, file.with_suffix(".label"), [0, 110, 111], scene(40 + number, seed=number))

    def make(**loading: Any) -> Folder:
        everything = {part: ["*.bin"] for part in ("train", "validation", "test")}
        return Folder(str(tmp_path), "wads", **everything, loading=Loading(**loading))

    return make
