"""A model over a recording: rays of other scans speak for drops, against walls, or not at all."""

import gc
import weakref
from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.export.recorded import HALF_SOLID, RecordedDerainer, added_log_odds, solidity
from derain.export.runtime import Derainer
from derain.files.extrinsics import motion_of_pose
from derain.recordings.rays import RayEvidence
from derain.scan import Scan
from derain.sources.file_frame import FileFrame
from derain.sources.frame import MemoryFrame
from derain.sources.judgement import Judgement
from derain.sources.judging import Failures, judgements
from derain.system.stopwatch import Stopwatch

from .test_persistence import drive, is_drop

FAILS = "a scan that makes the network fail"


class Doubtful(Derainer):
    """Doubts every drop, and one of ten points of walls; takes all else for solid.

    It fails where a scan is called so.
    """

    def judge_silently(self, points: Scan, stopwatch: Stopwatch | None = None) -> Judgement:
        if points.name == FAILS:
            raise InputError(self.name, f"its scores of {points.name} are none", "Look at it.")
        doubted = is_drop(points) | (np.arange(len(points)) % 10 == 0)
        probability = np.where(doubted, np.float32(0.3), np.float32(0.001))
        return Judgement(probability, probability > 0.4, points.valid, points)


@pytest.fixture(scope="module")
def model() -> Derainer:
    return Doubtful(threads=2)


def judged(
    model: Derainer, frames: Sequence[MemoryFrame], past: int = 1, delay: int = 1
) -> list[Judgement]:
    method = RecordedDerainer(model, past, delay)
    return [judgement for _, judgement, _ in judgements(method, frames)]


@pytest.mark.parametrize("posed", [True, False], ids=["poses", "odometry"])
@pytest.mark.parametrize(("past", "delay"), [(1, 0), (1, 1), (0, 1)])
def test_drops_become_likelier_and_walls_less_likely(model, posed, past, delay) -> None:
    for judgement in judged(model, drive(posed=posed), past, delay)[1:-1]:
        alone, drop = model.judge(judgement.scan).probability, is_drop(judgement.scan)
        assert (judgement.probability[alone < 0.01] == alone[alone < 0.01]).all()
        assert (judgement.probability[drop] > 0.3).mean() > 0.7
        assert (judgement.probability[~drop & (alone > 0.01)] < 0.3).mean() > 0.8


def test_without_anything_to_go_by_it_is_the_model(model) -> None:
    frames = drive(3)
    turned = frames[1].sensor_to_world @ np.diag([-1.0, -1, 1, 1])
    turned[:2, 3] += 30
    jumps = [frames[0], replace(frames[1], sensor_to_world=turned), frames[2]]
    repeats = [replace(frames[0], number=n, key=str(n)) for n in range(3)]
    apart = [replace(frame, sequence=str(n)) for n, frame in enumerate(frames)]
    askew = frames[1].sensor_to_world @ motion_of_pose(0, 0, 0, 0, 0, 30)
    wrong = [frames[0], replace(frames[1], sensor_to_world=askew)]
    for recording in (frames[:1], repeats, apart, jumps[:2], wrong):
        for judgement in judged(model, recording):
            alone = model.judge(judgement.scan)
            np.testing.assert_array_equal(judgement.probability, alone.probability)


@pytest.mark.parametrize("delay", [0, 1])
def test_a_scan_that_is_there_twice_is_reported_and_the_first_whose_pose_is_not_known(
    model, delay
) -> None:
    twice, lost = "unlike the scans around it", "its pose is not known"
    first, second = (replace(frame, sensor_to_world=None) for frame in drive(2))
    elsewhere = replace(second, scan=replace(second.scan, xyz=first.scan.xyz[::-1] * 7))
    again = replace(elsewhere, number=2, scan=replace(second.scan, xyz=first.scan.xyz[::-1] * 3))
    others = [replace(frame, sequence="another") for frame in (first, elsewhere)]
    for followers, expected in (
        ([replace(first, number=1)], [[twice]]),
        ([second], [[]]),
        ([elsewhere, again], [[lost], []]),
        ([elsewhere, *others], [[lost], [], [lost]]),
    ):
        method, kinds = RecordedDerainer(model, 1, delay), []
        for _, judgement, _ in judgements(method, [first, *followers]):
            kinds.append([issue.kind for issue in method.issues(judgement)])
        assert [[k for k in of_scan if k in (twice, lost)] for of_scan in kinds[1:]] == expected


@pytest.mark.parametrize("wrong", ["unreadable", "empty", "nothing but NaN", "makes it fail"])
@pytest.mark.parametrize("posed", [True, False], ids=["poses", "odometry"])
def test_scans_beside_one_that_fails_are_judged_without_it(model, posed, wrong) -> None:
    first, beside, last = drive(3, posed=posed)
    broken = {
        "unreadable": FileFrame(key=beside.key, number=1, path=Path("absent.bin")),
        "empty": replace(beside, scan=Scan.of(np.zeros((0, 4)))),
        "nothing but NaN": replace(beside, scan=Scan.of(np.full((50, 4), np.nan))),
        "makes it fail": replace(beside, scan=replace(beside.scan, name=FAILS)),
    }[wrong]
    failures = Failures(lambda error: None)
    method = RecordedDerainer(model, 1, 1)
    answers = {
        frame.number: judgement
        for frame, judgement, _ in judgements(
            method, [first, broken, last], failures.skipping_failures
        )
    }
    fails = wrong in ("unreadable", "makes it fail")
    assert (len(failures.errors), len(answers)) == ((1, 2) if fails else (0, 3))
    for number in (0, 2):
        alone = model.judge(answers[number].scan).probability
        np.testing.assert_array_equal(answers[number].probability, alone)


def test_where_no_ray_is_near_nothing_is_added() -> None:
    evidence = RayEvidence(np.array([0.0, 0, 1]), np.array([0.0, 1, 0]))
    nothing, through, ending = added_log_odds(evidence)
    assert nothing == 0
    assert ending < 0 < through


def test_ends_of_rays_are_the_less_solid_the_likelier_they_are_rain() -> None:
    log_odds = HALF_SOLID + np.array([-3, 0, 3])
    probability = (1 / (1 + np.exp(-log_odds))).astype(np.float32)
    of_logistic = 1 / (1 + np.exp([-3, 0, 3]))
    np.testing.assert_allclose(solidity(probability), of_logistic, rtol=1e-5)
    np.testing.assert_array_equal(solidity(np.array([0, 1], np.float32)), [1, 0])


def test_scans_that_are_no_longer_seen_are_let_go(model) -> None:
    method, judged_scans = RecordedDerainer(model, past=1, delay=1), []
    for frame in drive(5):
        if (judgement := method.push(frame)) is not None:
            judged_scans.append(weakref.ref(judgement.scan))
        del judgement
    gc.collect()
    assert [scan() is None for scan in judged_scans] == [True, True, False, False]
