"""Views that ask for scans around one are given those of its sequence, and no other."""

from dataclasses import replace
from types import SimpleNamespace
from typing import Any

import numpy as np
import pytest

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading
from derain.datamodules.in_memory import InMemory
from derain.datamodules.loader import scan_loader
from derain.datamodules.scan_dataset import view_in_window
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.task import agree_on_task
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.sources.frame import MemoryFrame
from derain.sources.source import Frames
from derain.views.neighbours import NeighbourView
from derain.views.window import Window, WindowOfScans


def drives(*lengths: int) -> Frames:
    """Sequences of so many scans; a scan's first intensity is its number."""
    frames, number = [], 0
    for sequence, length in enumerate(lengths):
        for place in range(length):
            points = scene(30, seed=number)
            points[0, 3] = number
            frames.append(
                MemoryFrame(
                    key=f"{number}",
                    sequence=f"{sequence}",
                    number=place,
                    scan=Scan.of(points).with_label(np.resize([0, 110], 30)),
                    time=number / 10,
                    sensor_to_world=np.diag([1.0, 1, 1, 1]) * (number + 1),
                )
            )
            number += 1
    return Frames(frames)


def which(scan: Scan) -> int:
    return int(scan.intensity[0])


@pytest.mark.parametrize(
    ("number", "before", "after"),
    [(0, [], [1]), (1, [0], [2]), (3, [1, 2], []), (4, [], [5]), (6, [4, 5], [])],
)
def test_scans_around_one_are_of_its_sequence_the_oldest_first(number, before, after) -> None:
    frames, windows = drives(4, 3), []
    view: Any = SimpleNamespace(window=Window(before=2, after=1), of_window=windows.append)
    view_in_window(view, frames[number].read(), frames, number, lambda frame: frame.read())
    (window,) = windows
    assert which(window.scan) == number
    assert [which(placed.scan) for placed in window.before] == before
    assert [which(placed.scan) for placed in window.after] == after
    for placed in (*window.before, window.judged, *window.after):
        assert placed.time == which(placed.scan) / 10
        assert placed.pose[0, 0] == which(placed.scan) + 1


def test_a_window_reaches_over_no_gap() -> None:
    frames, windows = drives(5), []
    view: Any = SimpleNamespace(window=Window(before=9, after=9), of_window=windows.append)
    gap = Frames([*frames[:2], *frames[3:]])
    for number in range(4):
        view_in_window(view, gap[number].read(), gap, number, lambda frame: frame.read())
    around = [[which(placed.scan) for placed in (*w.before, w.judged, *w.after)] for w in windows]
    assert around == [[0, 1], [0, 1], [3, 4], [3, 4]]


def test_a_loader_gives_a_network_its_windows(monkeypatch) -> None:
    data = InMemory(drives(3, 2), card="wads")
    task = agree_on_task(OutDet(), data)
    windows: list[WindowOfScans] = []

    def of_window(self: NeighbourView, scans: WindowOfScans) -> object:
        windows.append(scans)
        return self(scans.scan)

    monkeypatch.setattr(NeighbourView, "window", Window(before=1))
    monkeypatch.setattr(NeighbourView, "of_window", of_window)
    still = Augmentation(rotation_probability=0, jitter_probability=0)
    list(scan_loader(data.source("train"), "predict", task))
    judged = [which(window.scan) for window in windows]
    assert judged == [0, 1, 2, 3, 4]
    before = [[which(placed.scan) for placed in window.before] for window in windows]
    assert before == [[], [0], [1], [], [3]]
    with pytest.raises(InputError, match=r"the scans around it.* Set rotation_probability"):
        scan_loader(data.source("train"), "train", task)
    scan_loader(data.source("train"), "train", task, replace(Loading(), augmentation=still))
