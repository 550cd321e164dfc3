"""A teacher's labels are compared with the answers of persistence."""

from pathlib import Path

from recorded_scenes import write_scenes

from derain.annotation.teach import teach
from derain.datamodules.taught import Taught
from derain.evaluation.answers import NOT_KNOWN, RAIN
from derain.filters import DROR, FilterDerainer
from derain.recordings.persistence import PersistenceDerainer
from derain.recordings.posed import with_poses
from derain.sources.folders import named_frames
from derain.sources.judging import judgements
from derain.workflows.evaluation import beside_persistence


def test_persistence_sees_the_scans_around_those_held_out(tmp_path) -> None:
    drive = write_scenes(tmp_path / "drive/velodyne", *12 * [2000])
    teach(FilterDerainer(DROR()), named_frames([drive]), tmp_path / "taught")
    data = Taught(str(tmp_path / "taught"))
    recording = with_poses(named_frames([drive]), "standing")
    answers = beside_persistence(data, recording)
    whole = [judgement for _, judgement, _ in judgements(PersistenceDerainer(), recording)]
    held_out = whole[-len(data.frames("validation")) :]
    assert 1 < len(held_out) < len(whole)
    expected = [
        sum(int((one.scan.valid & ~one.answered).sum()) for one in held_out),
        sum(int(one.rain.sum()) for one in held_out),
    ]
    assert [*answers.table.sum(axis=(0, 2))[[NOT_KNOWN, RAIN]]] == expected
    assert min(expected) > 0
    by_teacher = [data.card.rain_of(data.reader.read(frame)) for frame in data.frames("validation")]
    assert answers.table[..., 1].sum() == sum(rain.sum() for rain in by_teacher)
    before_held_out = recording[len(whole) - len(held_out) - 1]
    Path(before_held_out.name).write_bytes(b"damaged")
    assert beside_persistence(data, recording).table[..., 1].sum() == answers.table[..., 1].sum()
