"""Data sets of sequences are found where they were published, split as they were published."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

from derain.cards.layout import Layout
from derain.datamodules.base import Loading
from derain.datamodules.rehearse3d import Rehearse3D
from derain.datamodules.sequences import SequenceDataModule
from derain.datamodules.wads import Wads
from derain.errors import InputError

Write = Callable[..., None]
FOLDERS = {Rehearse3D: ("lidar_radar_pcd", "lidar_radar_labels"), Wads: ("velodyne", "labels")}
SPLIT = {"train": ["007", "003"], "validation": ["010"], "test": ["011"]}


@pytest.fixture(params=FOLDERS, ids=lambda data_set: data_set.__name__)
def data_set(request: pytest.FixtureRequest) -> type[SequenceDataModule]:
    return request.param


@pytest.fixture
def root(tmp_path: Path, data_set: type[SequenceDataModule], write: Write) -> Path:
    """Three sequences of two scans, and one whose scans have no labels."""
    scans, labels = FOLDERS[data_set]
    for sequence in ("003", "007", "010", "011"):
        folder = tmp_path / "sequences" / sequence
        for frame in ("000001", "000000"):
            label = None if sequence == "011" else folder / labels / f"{frame}.label"
            write(folder / scans / f"{frame}.bin", label)
    return tmp_path


def test_rehearse_3d_is_split_as_published() -> None:
    split = Rehearse3D(root="somewhere").split
    assert {part: len(names) for part, names in split.items()} == {
        "train": 86,
        "validation": 28,
        "test": 29,
    }
    sequences = [name for names in split.values() for name in names]
    assert sorted(sequences) == [f"{number:03d}" for number in range(143)]
    assert (split["train"][0], split["validation"][0], split["test"][0]) == ("000", "001", "005")
    assert (split["train"][-1], split["validation"][-1], split["test"][-1]) == ("142", "133", "138")


def test_wads_is_split_as_published() -> None:
    assert Wads(root="somewhere").split == {
        "train": ("14", "15", "18", "20", "24", "28", "34", "36", "37"),
        "validation": ("11", "16"),
        "test": ("12", "13", "17", "22", "23", "26", "30", "35", "76"),
    }


def test_wads_is_measured_on_distinct_points() -> None:
    assert Wads(root="somewhere", loading=Loading(batch_size=4)).distinct
    assert not Wads(root="somewhere", loading=Loading(deduplicate=False)).distinct
    assert not Rehearse3D(root="somewhere").distinct


def test_scans_come_in_the_order_of_the_split_with_their_labels(
    data_set: Callable[..., SequenceDataModule], root: Path
) -> None:
    scans, labels = FOLDERS[data_set]
    frames = data_set(root=str(root), split=SPLIT).frames("train")
    sequences = root / "sequences"
    assert [(frame.path, frame.label_path) for frame in frames] == [
        (
            sequences / sequence / scans / f"{frame}.bin",
            sequences / sequence / labels / f"{frame}.label",
        )
        for sequence in ("007", "003")
        for frame in ("000000", "000001")
    ]


def test_prediction_is_on_the_test_scans_which_need_no_labels(
    data_set: Callable[..., SequenceDataModule], root: Path
) -> None:
    data = data_set(root=str(root), split=SPLIT)
    frames = data.frames("predict")
    assert [frame.key for frame in frames] == ["000000", "000001"]
    assert {frame.sequence for frame in frames} == {"011"}
    assert {frame.label_path for frame in frames} == {None}
    with pytest.raises(InputError, match=r"011/.*000000\.bin: its labels are not at .*\.label"):
        data.frames("test")


def test_folders_can_have_other_names(tmp_path: Path, write: Write) -> None:
    for frame in ("a", "b"):
        label = tmp_path / "runs" / "17" / "truth" / f"{frame}.label"
        write(tmp_path / "runs" / "17" / "ouster" / f"{frame}.pcd", label)
    layout = Layout(sequences="runs", scans="ouster", labels="truth")
    data = Rehearse3D(root=str(tmp_path), layout=layout, split={"train": ["17"]})
    assert [frame.path.name for frame in data.frames("train")] == ["a.pcd", "b.pcd"]


def test_a_part_without_sequences_is_refused(
    data_set: Callable[..., SequenceDataModule], root: Path
) -> None:
    data: Any = data_set(root=str(root), split={"train": ["003"]})
    for part in ("validation", "test", "predict"):
        with pytest.raises(InputError, match=f"{root}: no sequences are named for {part}"):
            data.frames(part)


def test_a_sequence_that_is_not_there_is_named(
    data_set: Callable[..., SequenceDataModule], root: Path
) -> None:
    data = data_set(root=str(root), split={"train": ["003", "099"]})
    with pytest.raises(InputError, match=f"099/{FOLDERS[data_set][0]}: no such folder, though"):
        data.frames("train")
    with pytest.raises(InputError, match=r"nowhere/sequences/.*: no such folder"):
        data_set(root="nowhere").frames("train")


def test_a_sequence_without_scans_is_named(
    data_set: Callable[..., SequenceDataModule], tmp_path: Path
) -> None:
    scans, _ = FOLDERS[data_set]
    (tmp_path / "sequences" / "003" / scans).mkdir(parents=True)
    with pytest.raises(InputError, match=f"003/{scans}: holds no scans"):
        data_set(root=str(tmp_path), split={"train": ["003"]}).frames("train")


def test_the_real_sequence_is_found(shared: Path) -> None:
    data = Wads(root=str(shared / "data/wads"), split={"train": ["36"]})
    frames = data.frames("train")
    assert len(frames) == 10
    scan = data.read(frames[0])
    assert len(scan) > 200_000
    assert scan.label is not None
    assert {110, 111} <= set(scan.label.tolist())
