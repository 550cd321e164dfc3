"""What the tests of data modules share."""

from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.datamodules.base import ScanDataModule
from derain.evaluation.hard_cases import scene
from derain.files import write_scan
from derain.files.labels import write_labels
from derain.learning.task import agree_on_task
from derain.models.base import DerainingModule
from derain.models.outdet import OutDet
from derain.scan import Scan


@pytest.fixture
def write() -> Callable[..., None]:
    """Writes a scan, by default of 50 points, and its labels, ids repeated over the points."""

    def write(
        scan: Path,
        labels: Path | None = None,
        ids: Sequence[int] = (0,),
        points: NDArray[np.float32] | None = None,
    ) -> None:
        points = scene(50) if points is None else points
        write_scan(scan, Scan.of(points))
        if labels is not None:
            write_labels(labels, np.resize(np.array(ids), len(points)))

    return write


@pytest.fixture
def connect() -> Callable[..., ScanDataModule]:
    """Has a data module agree with a model, by default 3D-OutDet, as a trainer would."""

    def connect(
        data: ScanDataModule, neighbours: int = 9, model: DerainingModule | None = None
    ) -> ScanDataModule:
        agree_on_task(OutDet(neighbours=neighbours) if model is None else model, data)
        return data

    return connect
