"""Frames in time order."""

import pickle

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.source import Frames

SCANS = [Scan.of(scene(points)) for points in range(1, 6)]


def points(source: Frames) -> list[int]:
    return [len(frame.read()) for frame in source]


@given(
    *(st.none() | st.integers(-7, 7) for _ in range(2)),
    st.none() | st.integers(-3, 3).filter(lambda step: step != 0),
)
def test_slices_are_those_of_a_list(start: int | None, stop: int | None, step: int | None) -> None:
    place = slice(start, stop, step)
    source = Frames.of_scans(SCANS)[place]
    assert isinstance(source, Frames)
    assert points(source) == [1, 2, 3, 4, 5][place]


@pytest.mark.parametrize("place", [-5, -1, 0, 4])
def test_places_are_those_of_a_list(place: int) -> None:
    source = Frames.of_scans(SCANS)
    assert source[place] is [*source][place]
    assert source[np.int64(place)] is source[place]  # as what draws at random gives them


@pytest.mark.parametrize("place", [-6, 5])
def test_places_beyond_the_ends_are_none(place: int) -> None:
    with pytest.raises(IndexError):
        Frames.of_scans(SCANS)[place]


def test_a_source_can_be_gone_through_again() -> None:
    source = Frames(iter(Frames.of_scans(SCANS, "drive")))
    assert [frame.key for frame in source] == [f"drive/{number:06d}" for number in range(5)]
    assert [frame.number for frame in source] == [*range(5)]
    assert {frame.sequence for frame in source} == {"drive"}
    assert points(pickle.loads(pickle.dumps(source))) == [1, 2, 3, 4, 5]
    assert points(source) == points(source) == [1, 2, 3, 4, 5]
    assert [len(frame.read()) for frame in reversed(source)] == [5, 4, 3, 2, 1]


def test_every_frame_can_be_changed() -> None:
    labelled = [scan.with_label(np.zeros(len(scan), np.int64)) for scan in SCANS]
    source = Frames.of_scans(labelled)
    bare = source.map(lambda frame: frame.without_labels())
    assert [frame.has_labels for frame in source] == 5 * [True]
    assert [frame.has_labels for frame in bare] == 5 * [False]
    assert [frame.key for frame in bare] == [frame.key for frame in source]
