"""Data sets of sequences are found where they were published, split as they were published."""

from pathlib import Path

import pytest

from derain.datamodules.base import Loading
from derain.datamodules.rehearse3d import Rehearse3D
from derain.datamodules.sequences import Sequences
from derain.datamodules.wads import Wads
from derain.errors import InputError

SPLIT = {"train": ["007", "003"], "validation": ["010"], "test": ["011"]}


@pytest.fixture
def root(tmp_path, write) -> Path:
    """Three sequences of two scans, and one whose scans have no labels."""
    for sequence in ("003", "007", "010", "011"):
        folder = tmp_path / "sequences" / sequence
        for frame in ("000001", "000000"):
            label = None if sequence == "011" else folder / f"lidar_radar_labels/{frame}.label"
            write(folder / f"lidar_radar_pcd/{frame}.bin", label)
    return tmp_path


def test_data_sets_are_split_and_counted_as_published() -> None:
    split = Rehearse3D(root="somewhere").split
    sizes = {part: len(names) for part, names in split.items()}
    assert sizes == {"train": 86, "validation": 28, "test": 29}
    sequences = [name for names in split.values() for name in names]
    assert sorted(sequences) == [f"{number:03d}" for number in range(143)]
    assert (split["train"][0], split["validation"][0], split["test"][0]) == ("000", "001", "005")
    assert Wads(root="somewhere").split == {
        "train": ("14", "15", "18", "20", "24", "28", "34", "36", "37"),
        "validation": ("11", "16"),
        "test": ("12", "13", "17", "22", "23", "26", "30", "35", "76"),
    }
    assert Wads(root="somewhere", loading=Loading(batch_size=4)).reader.distinct
    assert not Wads(root="somewhere", loading=Loading(deduplicate=False)).reader.distinct
    assert not Rehearse3D(root="somewhere").reader.distinct


def test_scans_come_in_the_order_of_the_split_with_their_labels(root) -> None:
    frames = Rehearse3D(root=str(root), split=SPLIT).frames("train")
    assert [(frame.path, frame.label_path) for frame in frames] == [
        (
            root / f"sequences/{sequence}/lidar_radar_pcd/{frame}.bin",
            root / f"sequences/{sequence}/lidar_radar_labels/{frame}.label",
        )
        for sequence in ("007", "003")
        for frame in ("000000", "000001")
    ]


def test_prediction_is_on_the_test_scans_which_need_no_labels(root) -> None:
    data = Rehearse3D(root=str(root), split=SPLIT)
    frames = data.frames("predict")
    assert [frame.key for frame in frames] == ["000000", "000001"]
    assert {frame.sequence for frame in frames} == {"011"}
    assert {frame.label_path for frame in frames} == {None}
    with pytest.raises(InputError, match=r"011/.*000000\.bin: its labels are not at .*\.label"):
        data.frames("test")


def test_folders_can_have_other_names(tmp_path, write) -> None:
    label = tmp_path / "runs/17/truth/a.label"
    write(tmp_path / "runs/17/ouster/a.pcd", label)
    card = tmp_path / "card.yaml"
    card.write_text(
        "{name: mine, classes: {0: road, 1: rain}, rain: [1], "
        "layout: {sequences: runs, scans: ouster, labels: truth}}"
    )
    (frame,) = Sequences(str(tmp_path), str(card), split={"train": ["17"]}).frames("train")
    assert (frame.path.name, frame.label_path) == ("a.pcd", label)


def test_a_split_with_another_part_is_refused() -> None:
    with pytest.raises(InputError, match=r"^split\.trian: .*Did you mean train\? Available: "):
        Rehearse3D(root="somewhere", split={"trian": ["003"]})


@pytest.mark.parametrize(
    ("split", "part", "message"),
    [
        ({"train": ["003"]}, "validation", "are named for validation.* --part"),
        ({"train": ["003"]}, "predict", "no sequences are named for predict"),
        ({"train": ["003", "099"]}, "train", "099/lidar_radar_pcd: no such folder, though"),
        ({"train": ["empty"]}, "train", "empty/lidar_radar_pcd: holds no scans"),
    ],
)
def test_a_part_without_scans_is_refused(root, split, part, message) -> None:
    (root / "sequences/empty/lidar_radar_pcd").mkdir(parents=True)
    with pytest.raises(InputError, match=message) as refusal:
        Rehearse3D(root=str(root), split=split).frames(part)
    assert str(root) in str(refusal.value)
