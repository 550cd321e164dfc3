"""Labelled scans that the tests of scores share."""

from dataclasses import replace

import numpy as np
import pytest

from derain.cards.card import DataCard
from derain.evaluation.hard_cases import scene
from derain.scan import Scan

CARD = DataCard("made up", {0: "solid", 3: "rain", 9: "unknown"}, rain=(3,), unknown=(9,))


@pytest.fixture
def card() -> DataCard:
    return CARD


@pytest.fixture
def scans() -> list[Scan]:
    """Three scans of 300 points, of which 30 are drops, and in the first 20 are not known."""
    made = []
    for number in range(3):
        label = np.where(np.arange(300) >= 270, 3, 0)
        if number == 0:
            label[:20] = 9
        made.append(replace(Scan.of(scene(300, seed=number), f"scan {number}"), label=label))
    return made
