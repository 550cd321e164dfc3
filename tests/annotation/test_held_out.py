"""The held-out scans are a stretch at the end of each sequence."""

from itertools import groupby

import pytest

from derain.annotation.manifest import parts_of
from derain.evaluation.hard_cases import scene
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.source import Frames


def sequence(length: int, name: str = "drive") -> list[Frame]:
    return [*Frames.of_scans([Scan.of(scene(5))] * length, name)]


@pytest.mark.parametrize(
    ("length", "held_out"), [(0, 0), (1, 0), (2, 0), (3, 1), (5, 1), (9, 1), (10, 2), (20, 4)]
)
def test_a_fifth_is_held_out_and_one_of_three(length: int, held_out: int) -> None:
    parts = list(parts_of(sequence(length)))
    assert parts == ["train"] * (length - held_out) + ["validation"] * held_out


def test_every_sequence_ends_with_such_scans_whatever_it_is_called() -> None:
    frames = [*sequence(4), *sequence(3), *sequence(2, "other"), *sequence(11, "third")]
    runs = [(part, len([*group])) for part, group in groupby(parts_of(frames))]
    assert runs == [
        *(("train", 3), ("validation", 1), ("train", 2), ("validation", 1)),
        *(("train", 2 + 9), ("validation", 2)),
    ]


def test_scans_that_are_missing_end_no_sequence() -> None:
    frames = sequence(7)
    assert list(parts_of([*frames[:2], *frames[4:]])) == ["train"] * 4 + ["validation"]
