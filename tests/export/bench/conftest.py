"""Labelled scans that the tests of the bench share."""

from pathlib import Path

import numpy as np
import pytest

from derain.cards.card import DataCard
from derain.evaluation.hard_cases import scene
from derain.export.bench.scores import Labelled
from derain.files import read_scan
from derain.files.labels import label_beside, read_labels, semantic, write_labels
from derain.scan import Scan

CARD = DataCard("made up", {0: "solid", 3: "rain", 9: "unknown"}, rain=(3,), unknown=(9,))


def read(path: Path) -> Scan:
    scan = read_scan(path)
    return scan.with_label(semantic(read_labels(label_beside(path), len(scan))))


@pytest.fixture
def labelled(tmp_path: Path) -> Labelled:
    """Three scans of 300 points, of which 30 are drops, and in the first 20 are not known."""
    scans = []
    for number in range(3):
        path = tmp_path / "scans" / f"{number}.bin"
        path.parent.mkdir(exist_ok=True)
        scene(300, seed=number).tofile(path)
        label = np.where(np.arange(300) >= 270, 3, 0)
        if number == 0:
            label[:20] = 9
        write_labels(path.with_suffix(".label"), label)
        scans.append(path)
    return Labelled(CARD, scans, read, rain_rate=dict(zip(scans, (10.0, 25.0, 10.0), strict=True)))
