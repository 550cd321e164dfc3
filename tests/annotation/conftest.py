"""What the tests of teaching share."""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels

POINTS = 200

MakeDrive = Callable[..., Path]


@pytest.fixture
def make_drive(tmp_path: Path) -> MakeDrive:
    """Writes a recording of some scans, and labels of WADS if asked: every tenth point is snow."""

    def make(name: str = "drive", scans: int = 6, labelled: bool = False) -> Path:
        folder = tmp_path / name / "velodyne"
        folder.mkdir(parents=True)
        for number in range(scans):
            scene(POINTS, number).tofile(folder / f"{number:06d}.bin")
            if labelled:
                truth = np.where(np.arange(POINTS) % 10, 40, 110)
                write_labels(folder.parent / f"labels/{number:06d}.label", truth)
        return folder

    return make
