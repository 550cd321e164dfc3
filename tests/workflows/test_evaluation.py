"""A finished model is measured by labels beside its scans, where a user asks for that."""

from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_scenes
from small_bags import small_bag

from derain.annotation.teach import teach
from derain.cards.card import load_card
from derain.datamodules.taught import Taught
from derain.evaluation.answers import NOT_KNOWN, RAIN
from derain.evaluation.counts import Counts
from derain.files.labels import write_labels
from derain.filters import DROR, FilterDerainer
from derain.recordings.persistence import PersistenceDerainer
from derain.recordings.posed import with_poses
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.sources.judging import judgements
from derain.workflows.evaluation import beside_persistence, scores_by_labels

DROPS = np.arange(300) >= 270


@pytest.fixture
def data(tmp_path) -> Taught:
    """A drive of three scans that a filter has taught."""
    drive = write_scenes(tmp_path / "drive/velodyne", *3 * [300], name="{}.bin")
    teach(FilterDerainer(DROR()), named_frames([drive]), tmp_path / "taught")
    return Taught(str(tmp_path / "taught"))


def student(scan: Scan) -> np.ndarray:
    """Finds every drop, and takes ten points of the road for some."""
    return DROPS | (np.arange(len(scan)) < 10)


def label(tmp_path: Path, rain: int) -> None:
    write_labels(tmp_path / "drive/labels/2.label", np.where(DROPS, rain, 0))


def test_teacher_and_student_are_measured_by_the_labels(data, tmp_path) -> None:
    label(tmp_path, rain=110)
    frames = data.frames("validation")
    text = scores_by_labels(frames, data.card, "wads", student)
    (scan,) = map(data.read, frames)
    taught = Counts.of(data.card.rain_of(scan), DROPS)
    rows = {line.split("|")[1].strip(): line for line in text.splitlines() if "|" in line}
    assert f"{taught.precision:.3f} | {taught.recall:.3f}" in rows["teacher"]
    assert f"{taught.iou:.3f}" in rows["teacher, where it is sure"]
    assert "0.750 | 1.000 | 0.857 | 0.750" in rows["student"]
    assert rows["falling-snow (rain)"].split("|")[2].strip() == "30"
    assert "100.00%" in rows["falling-snow (rain)"]
    solid = load_card("wads").classes[0]
    assert f"{10 / 270:.2%}" in rows[solid]


def test_labels_beside_a_bag_measure_too(tmp_path) -> None:
    bag = small_bag(tmp_path, "mcap")
    write_labels(tmp_path / "drive.labels/000002.label", np.where(DROPS, 110, 0))
    teach(FilterDerainer(DROR()), named_frames([bag]), tmp_path / "taught")
    data = Taught(str(tmp_path / "taught"))
    text = scores_by_labels(data.frames("validation"), data.card, "wads", student)
    assert "0.750 | 1.000 | 0.857 | 0.750" in text


@pytest.mark.parametrize("card", ["wads", "no_such_card"])
def test_labels_that_cannot_be_used_are_named(data, tmp_path, card) -> None:
    label(tmp_path, rain=65535)
    text = scores_by_labels(data.frames("validation"), data.card, card, student)
    assert text.startswith("Nothing could be measured: ")


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
    by_teacher = [data.card.rain_of(data.read(frame)) for frame in data.frames("validation")]
    assert answers.table[..., 1].sum() == sum(rain.sum() for rain in by_teacher)
    before_held_out = recording[len(whole) - len(held_out) - 1]
    Path(before_held_out.name).write_bytes(b"damaged")
    assert beside_persistence(data, recording).table[..., 1].sum() == answers.table[..., 1].sum()
