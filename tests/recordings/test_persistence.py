"""Persistence as a method: what a drive past walls, drops and cars comes to."""

import pickle
from collections.abc import Iterable
from dataclasses import replace

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.methods import load_method
from derain.files import write_scan
from derain.files.extrinsics import motion_of_pose
from derain.recordings.persistence import Persistence, PersistenceDerainer
from derain.scan import Bools, Floats, Scan
from derain.sources.folders import named_frames
from derain.sources.frame import MemoryFrame
from derain.sources.judgement import Judgement
from derain.sources.judging import judgements

# Of every scan the last points are drops.
DROPS = 60

STEP = np.radians(0.5)


def seen_from(x: float, seed: int) -> Floats:
    """A yard with a floor, walls and drops, seen by a sensor at (x, 0, 0), float64 (N, 3)."""
    generator = np.random.default_rng(seed)
    azimuth = np.arange(-np.pi, np.pi, STEP)
    inclination = (np.arange(34) - 25) * STEP
    azimuth, inclination = (a.ravel() for a in np.meshgrid(azimuth, inclination))
    rays = np.stack([np.cos(azimuth), np.sin(azimuth), np.tan(inclination)], axis=1)
    with np.errstate(divide="ignore", invalid="ignore"):
        to_walls = np.stack(
            [
                np.where(rays[:, 0] > 0, (15 - x) / rays[:, 0], (-15 - x) / rays[:, 0]),
                np.abs(8 / rays[:, 1]),
                np.where(rays[:, 2] < 0, -1.7 / rays[:, 2], np.inf),
            ]
        )
    walls = rays * to_walls.min(axis=0)[:, None]
    walls *= 1 + generator.normal(0, 1e-3, (len(walls), 1))
    drops = walls[generator.choice(len(walls), DROPS, replace=False)]
    return np.concatenate([walls, drops * generator.uniform(0.3, 0.8, (DROPS, 1))])


def drive(scans: int = 4, step: float = 0.5, posed: bool = True) -> list[MemoryFrame]:
    frames = []
    for number in range(scans):
        pose = np.eye(4)
        pose[0, 3] = number * step
        frames.append(
            MemoryFrame(
                key=f"{number:06d}",
                number=number,
                scan=Scan.of(seen_from(number * step, number), f"scan {number}"),
                sensor_to_world=pose if posed else None,
            )
        )
    return frames


def judged(frames: Iterable[MemoryFrame], **parameters: int) -> list[Judgement]:
    method = PersistenceDerainer(Persistence(**parameters), threads=2)
    return [judgement for _, judgement, _ in judgements(method, frames)]


def is_drop(scan: Scan) -> Bools:
    return np.arange(len(scan)) >= len(scan) - DROPS


@pytest.mark.parametrize("posed", [True, False])
def test_it_finds_drops_and_leaves_walls(posed) -> None:
    answers = judged(drive(posed=posed))
    assert [answer.frame.number for answer in answers if answer.frame] == [0, 1, 2, 3]
    for answer in answers:
        drop = is_drop(answer.scan)
        assert answer.rain[drop].mean() > 0.8
        assert answer.rain[~drop].mean() < 0.005
        assert answer.known.mean() > 0.9
        assert (answer.rain == (answer.probability > 0.5) & answer.known).all()


def test_of_a_scan_alone_nothing_is_known_and_nothing_is_taken() -> None:
    (answer,) = judged(drive(1))
    assert not answer.known.any()
    assert not answer.rain.any()
    assert answer.probability[is_drop(answer.scan)].mean() > 0.5
    expected = [issue.kind for issue in PersistenceDerainer().issues(answer)]
    assert expected == ["nothing is known for sure"]


def test_no_evidence_is_taken_across_a_gap() -> None:
    near = drive(2)
    # This scan has no pose, and its own odometry has nothing to go on from.
    far = MemoryFrame(key="2", number=2, scan=Scan.of(np.full((400, 3), 50.0) + np.eye(3)[0]))
    (alone,), with_first, with_both = judged(near[1:]), judged(near)[1], judged([*near, far])[1]
    assert (with_both.probability == with_first.probability).all()
    assert not (with_both.probability == alone.probability).all()


def test_no_evidence_is_taken_of_a_wrong_pose_or_of_the_same_scan_again() -> None:
    first, second = drive(2)
    far = replace(second, sensor_to_world=motion_of_pose(1e6, 0, 0, 0, 0, 0))
    for follower in (far, replace(first, number=1)):
        method = PersistenceDerainer(Persistence(after=0), threads=2)
        method.push(first)
        answer = method.push(follower)
        assert not answer.known.any()
        kinds = [issue.kind for issue in method.issues(answer)]
        assert kinds == ["unlike the scans around it", "nothing is known for sure"]


def test_a_scan_of_drops_for_the_most_part_matches_those_around_it() -> None:
    before, middle, after = drive(3)
    walls, generator = middle.scan.xyz[:-DROPS], np.random.default_rng(0)
    wall = walls.reshape(34, -1, 3)[10:30, :15].reshape(-1, 3)
    drops = walls[generator.choice(len(walls), 600)] * generator.uniform(0.3, 0.8, (600, 1))
    dense = Scan.of(np.concatenate([wall, drops]).astype(np.float32))
    answer = judged([before, replace(middle, scan=dense), after])[1]
    assert answer.rain[len(wall) :].mean() > 0.8
    assert answer.rain[: len(wall)].mean() < 0.01


def test_a_registration_that_fails_is_warned_of() -> None:
    frames = drive(3, posed=False)
    nonsense = Scan.of(np.random.default_rng(0).uniform(-30, 30, (4000, 3)), "nonsense")
    frames[2] = MemoryFrame(key="2", number=2, scan=nonsense)
    method = PersistenceDerainer()
    answers = [judgement for _, judgement, _ in judgements(method, frames[:2])]
    assert not list(method.issues(answers[0]))
    for frame in frames:
        method.push(frame)
    # What waits is asked before the recording ends.
    last = next(method.flush())
    assert last.scan.name == "nonsense"
    details = [issue.detail for issue in method.issues(last)]
    assert any("its pose is not known" in detail for detail in details)


def test_damaged_records_are_done_without(tmp_path) -> None:
    for number, frame in enumerate(drive(3)):
        write_scan(tmp_path / f"yard/scan_{number}.pcd", frame.scan)
    frames = named_frames([tmp_path / "yard"])
    method = PersistenceDerainer(threads=2)
    plain = [judgement for _, judgement, _ in judgements(method, frames)]
    (tmp_path / "yard/poses.txt").write_text("1 0 0 0 0 1 0 0 0 0 1 0\n")  # one line for three
    (tmp_path / "yard/times.txt").write_text("soon\n")
    for (_, judgement, _), expected in zip(
        judgements(method, named_frames([tmp_path / "yard"])), plain, strict=True
    ):
        assert (judgement.probability == expected.probability).all()
        (issue,) = method.issues(judgement)
        assert "has 1 lines for 3 scans, and none for scan_" in issue.detail


def test_order_intensity_and_threads_change_nothing() -> None:
    generator, plain = np.random.default_rng(5), drive(3, posed=False)
    other, orders = [], []
    for frame in plain:
        order = generator.permutation(len(frame.scan))
        intensity = generator.uniform(0, 255, (len(order), 1))
        scan = Scan.of(np.hstack([frame.scan.xyz, intensity])[order])
        other.append(MemoryFrame(key=frame.key, number=frame.number, scan=scan))
        orders.append(order)
    answers = [judgement for _, judgement, _ in judgements(PersistenceDerainer(threads=1), other)]
    for first, second, order in zip(judged(plain), answers, orders, strict=True):
        np.testing.assert_array_equal(second.probability, first.probability[order])


def test_hard_cases_are_answered() -> None:
    frames = [
        MemoryFrame(key=name, number=number, scan=scan)
        for number, (name, scan) in enumerate(hard_cases(4000))
    ]
    answers = judged(frames)
    assert len(answers) == len(frames)
    for answer in answers:
        assert np.isfinite(answer.probability).all()
        assert not answer.rain[~answer.scan.valid].any()


@pytest.mark.parametrize(
    ("parameters", "expected"),
    [
        ({"before": -1}, "before: -1 is not"),
        ({"after": 51}, "after: 51 is not"),
        ({"sure": 0.5}, "sure: 0.5 is not"),
        ({"sure": "much"}, "sure: 'much' is not"),
        ({"reach": 3}, "it has no parameter reach"),
    ],
)
def test_wrong_parameters_are_refused(parameters, expected) -> None:
    with pytest.raises(InputError) as refused:
        load_method("persistence", parameters)
    assert expected in str(refused.value)


def test_real_snow_is_found_by_free_space(shared) -> None:
    from derain.cards.card import load_card
    from derain.sources.reader import FrameReader
    from derain.views.morton import first_rows

    drive = shared / "data/wads/drive/velodyne"
    frames = [f for f in named_frames([drive], labelled=True) if 2 <= f.number < 6]
    reader = FrameReader(load_card("wads"))
    found = wrong = missed = 0
    for frame, judgement, _ in judgements(PersistenceDerainer(), frames):
        rows = first_rows(judgement.scan)
        truth = reader.card.rain_of(reader.read(frame))[rows]
        rain = judgement.rain[rows]
        found += (rain & truth).sum()
        wrong += (rain & ~truth).sum()
        missed += (truth & ~rain).sum()
    assert found / (found + wrong + missed) > 0.87


def test_it_can_be_pickled_and_begins_a_recording_of_its_own() -> None:
    method = PersistenceDerainer(Persistence(before=2, sure=5.0), threads=1)
    method.push(scene(100))
    again = pickle.loads(pickle.dumps(method))
    assert (again.persistence, again.threads, again.waiting) == (method.persistence, 1, 0)
    content = method.as_dict()
    assert load_method(content.pop("method"), content).persistence == method.persistence
