"""Scans that a teacher has labelled are trained on and measured by what it is sure of."""

from collections import Counter
from pathlib import Path

import numpy as np
import pytest
from window_method import Between

from derain.annotation.manifest import TAUGHT_MANIFEST
from derain.annotation.teach import teach
from derain.datamodules.base import Loading, ScanDataModule
from derain.datamodules.labelled import card_of, labelled_scans
from derain.datamodules.taught import Taught
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.filters import DROR, FilterDerainer
from derain.sources.folders import named_frames

POINTS = 200


@pytest.fixture
def root(tmp_path) -> Path:
    """Two taught sequences, whose own labels are garbage; of their ends nothing is known."""
    for name, scans in (("00", 7), ("01", 5)):
        for number in range(scans):
            folder = tmp_path / f"drives/sequences/{name}/velodyne"
            folder.mkdir(parents=True, exist_ok=True)
            scene(POINTS, number).tofile(folder / f"{number:06d}.bin")
            (folder.parent / "labels").mkdir(exist_ok=True)
            (folder.parent / f"labels/{number:06d}.label").write_bytes(b"garbage")
    source = named_frames([tmp_path / "drives"], labelled=True).map(
        lambda frame: frame.with_intensity_times(2.0)
    )
    teach(Between(), source, tmp_path / "taught")
    return tmp_path / "taught"


def keys(data: ScanDataModule, part: str) -> list[str]:
    return [frame.key for frame in data.source(part)]


def test_the_ends_of_sequences_are_held_out(root) -> None:
    data = Taught(str(root))
    assert keys(data, "train") == [
        *(f"00/velodyne/{number:06d}" for number in range(1, 5)),
        *(f"01/velodyne/{number:06d}" for number in range(1, 3)),
    ]
    for part in ("validation", "test", "predict"):
        assert keys(data, part) == ["00/velodyne/000005", "01/velodyne/000003"]


def test_scans_are_read_with_the_teachers_labels_and_as_it_saw_them(root) -> None:
    data = Taught(str(root))
    frames = data.frames("train")
    scan = data.reader.read(frames[1])
    teacher = Between()
    answers = [teacher.push(frame.without_labels()) for frame in frames[:3]]
    np.testing.assert_array_equal(scan.intensity, 2 * scene(POINTS, 2)[:, 3])
    (known, rain) = (answers[2].answered, answers[2].rain)
    np.testing.assert_array_equal(data.card.unknown_of(scan), ~known)
    np.testing.assert_array_equal(data.card.rain_of(scan), known & rain)


def test_commands_that_measure_know_the_folder(root) -> None:
    card = card_of([root], None)
    assert card.name.endswith("taught by between")
    data = labelled_scans([root], card, Loading())
    assert [len(data.source(part)) for part in ("train", "test")] == [6, 2]


def test_what_is_no_such_folder_is_refused(tmp_path) -> None:
    with pytest.raises(InputError, match=TAUGHT_MANIFEST):
        Taught(str(tmp_path))


def test_without_a_held_out_scan_there_is_none_to_measure(tmp_path) -> None:
    scene(POINTS).tofile(tmp_path / "0.bin")
    write_labels(tmp_path / "0.label", np.zeros(POINTS, int))
    teach(FilterDerainer(DROR(), 1), named_frames([tmp_path / "0.bin"]), tmp_path / "taught")
    data = Taught(str(tmp_path / "taught"))
    assert keys(data, "train") == ["0"]
    with pytest.raises(InputError, match="none of its labelled scans is for test"):
        data.source("test")


def test_an_epoch_of_a_short_recording_shows_each_scan_as_often_as_any_other(root, connect) -> None:
    data = connect(Taught(str(root)))
    loader = data.train_dataloader()
    shown = [sample.cells for sample in loader]
    assert len(shown) == 18  # the six scans, three times: sixteen or more
    assert len(data.val_dataloader()) == 2
    counted = Counter(frame.key for frame in loader.dataset.frames)
    assert counted == dict.fromkeys(keys(data, "train"), 3)
    # Not three times the same: augmentation changes each in another way.
    first, again = (loader.dataset[place].scan.xyz for place in (0, 6))
    assert not np.array_equal(first, again)
