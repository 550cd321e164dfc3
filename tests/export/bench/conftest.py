"""Labelled scans that the tests of the bench share."""

import numpy as np
import pytest

from derain.cards.card import DataCard
from derain.evaluation.hard_cases import scene
from derain.export.bench.labelled_frames import LabelledFrames
from derain.files.labels import write_labels
from derain.sources.folders import named_frames
from derain.sources.reader import FrameReader

CARD = DataCard("made up", {0: "solid", 3: "rain", 9: "unknown"}, rain=(3,), unknown=(9,))


@pytest.fixture
def labelled(tmp_path) -> LabelledFrames:
    """Three scans of 300 points, of which 30 are drops, and in the first 20 are not known."""
    for number in range(3):
        path = tmp_path / f"sequence {number}/scans/{number}.bin"
        path.parent.mkdir(parents=True)
        scene(300, seed=number).tofile(path)
        label = np.repeat([9 if number == 0 else 0, 0, 3], [20, 250, 30])
        write_labels(path.with_suffix(".label"), label)
    folders = sorted(tmp_path.glob("sequence */scans"))
    rates = {"sequence 0": 10.0, "sequence 1": 25.0, "sequence 2": 10.0}
    return LabelledFrames(FrameReader(CARD), named_frames(folders, labelled=True), rain_rates=rates)
