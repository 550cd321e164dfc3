"""Whole recordings given to a method: every frame is answered for, in order, or passed over."""

from pathlib import Path

import numpy as np
import pytest
from window_method import Between

from derain.evaluation.hard_cases import scene
from derain.filters import DROR, FilterDerainer
from derain.scan import Scan
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judging import Failures, judgements
from derain.sources.source import Frames


def drive(*lengths: int) -> list[Frame]:
    """Recordings of so many scans."""
    return [
        frame
        for number, length in enumerate(lengths)
        for frame in Frames.of_scans(
            [Scan.of(scene(60, 10 * number + place)) for place in range(length)], str(number)
        ).map(Frame.without_labels)
    ]


@pytest.mark.parametrize("lengths", [(), (1,), (2,), (5,), (1, 1, 4), (3, 0, 2)])
@pytest.mark.parametrize("method", [Between(), FilterDerainer(DROR(), 1)])
def test_every_frame_is_answered_for_in_its_order(method, lengths) -> None:
    frames = drive(*lengths)
    answers = list(judgements(method, frames))
    assert [frame for frame, _, _ in answers] == frames
    assert all(judgement.frame is frame for frame, judgement, _ in answers)
    assert method.waiting == 0
    for frame, judgement, _ in answers:
        known = judgement.judged if judgement.known is None else judgement.known
        np.testing.assert_array_equal(judgement.answered, judgement.judged & known)
        # One scan before it and one after, in its recording, make `Between` sure.
        between = 0 < frame.number < lengths[int(frame.sequence)] - 1
        assert known.any() == (isinstance(method, FilterDerainer) or between)


def test_a_frame_that_fails_is_passed_over_and_no_window_reaches_over_it() -> None:
    frames, failures = drive(6), Failures(lambda error: None)
    frames[2] = FileFrame(key="2", sequence="0", number=2, path=Path("absent.bin"))
    answers = list(judgements(Between(), frames, failures.skipping_failures))
    assert [frame.number for frame, _, _ in answers] == [0, 1, 3, 4, 5]
    assert [error.subject for error in failures.errors] == [Path("absent.bin")]
    sure = [judgement.known is not None and judgement.known.any() for _, judgement, _ in answers]
    assert sure == [False, False, False, True, False]
