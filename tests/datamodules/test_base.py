"""From files to batches: what a model gets to see, and warnings of files that it cannot see."""

import pickle
import re
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading, ScanDataModule
from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.models.lisnownet import LiSnowNet
from derain.scan import Scan
from derain.views.neighbours import NeighbourView

Connect = Callable[..., ScanDataModule]
STILL = Augmentation(rotation_probability=0, jitter_probability=0)
SCANS = 6
SNOW = 110


def batches(data: ScanDataModule, part: str) -> list[Batch]:
    """One epoch, as the trainer gives it to the model."""
    try:
        return list(getattr(data, f"{part}_dataloader")())
    except InputError as error:
        # A traceback that pytest keeps would keep the loader, whose worker then ends late.
        raise error.with_traceback(None) from None


def scans(data: ScanDataModule, part: str) -> list[Scan]:
    """What a model is given in one epoch; batches of training scans are tensors alone."""
    if part == "train":
        loader: Any = data.train_dataloader()
        return [loader.dataset[pick].scan for pick in loader.sampler]
    return [measured.scan for batch in batches(data, part) for measured in batch.measured]


def test_what_is_not_trained_on_comes_in_order_and_untouched_in_batches_of_the_size_asked_for(
    folder, connect
) -> None:
    data = connect(folder(batch_size=4))
    for part in ("val", "test", "predict"):
        for number, scan in enumerate(scans(data, part)):
            points = scene(40 + number, seed=number)
            np.testing.assert_array_equal(np.c_[scan.xyz, scan.intensity], points)
    first, second = batches(data, "predict")
    assert (first.cells, second.cells) == ([40, 41, 42, 43], [44, 45])
    assert first.target is None


@pytest.mark.parametrize("neighbours", [3, 9])
def test_the_view_is_the_models_and_the_target_is_one_where_the_card_has_rain(
    folder, connect, neighbours
) -> None:
    batch = batches(connect(folder(), neighbours), "val")[0]
    scan = batch.measured[0].scan
    view = NeighbourView(neighbours)(scan)
    np.testing.assert_array_equal(batch.inputs["neighbours"], view.neighbours)
    np.testing.assert_array_equal(batch.inputs["distances"], view.distances)
    np.testing.assert_array_equal(batch.target.numpy(), scan.label[view.first] == SNOW)


def test_a_data_set_can_be_sent_to_a_worker(folder, connect) -> None:
    # Where processes do not fork, workers get the data set by pickling.
    dataset: Any = connect(folder(deduplicate=True)).val_dataloader().dataset
    sent = pickle.loads(pickle.dumps(dataset))
    assert len(sent) == SCANS
    np.testing.assert_array_equal(sent[3].view.points, dataset[3].view.points)


def test_duplicates_are_measured_once_and_every_row_is_predicted(tmp_path, write, connect) -> None:
    distinct = scene(30)
    rows = np.random.default_rng(0).permutation(np.resize(np.arange(30), 75))
    points = np.concatenate([distinct[rows], np.full((5, 4), np.nan, np.float32)])
    write(tmp_path / "a.bin", tmp_path / "a.label", [0, SNOW], points)
    parts = {part: ["a.bin"] for part in ("train", "validation", "test")}
    data = connect(
        Folder(str(tmp_path), "wads", **parts, loading=Loading(augmentation=STILL))
    )  # whose card asks for it
    for part in ("train", "val", "test"):
        (scan,) = scans(data, part)
        # The rows that remain are the first of their kind, in the order of the file.
        first = np.sort(np.unique(rows, return_index=True)[1])
        np.testing.assert_array_equal(scan.xyz, points[first, :3])
        np.testing.assert_array_equal(scan.label, np.resize([0, SNOW], 80)[first])
    ((measured,),) = (batch.measured for batch in batches(data, "predict"))
    back = measured.back_projection(np.arange(1, 31, dtype=np.float32))
    assert len(back) == 80
    np.testing.assert_array_equal(back[75:], 0)
    assert len(set(zip(rows.tolist(), back[:75].tolist(), strict=True))) == 30


@pytest.mark.parametrize(("card", "asked"), [("kitti", None), ("wads", False)])
def test_without_asking_duplicates_are_counted_as_often_as_they_are_there(
    tmp_path, write, connect, card, asked
) -> None:
    write(tmp_path / "a.bin", tmp_path / "a.label", [0], np.repeat(scene(10), 3, axis=0))
    loading = Loading(deduplicate=asked)
    data = connect(Folder(str(tmp_path), card, train=["a.bin"], test=["a.bin"], loading=loading))
    assert [len(scan) for scan in scans(data, "test")] == [30]


def test_a_model_that_learns_from_no_labels_is_only_measured_by_those_that_there_are(
    folder, connect, small_grid, tmp_path
) -> None:
    data = connect(folder(batch_size=SCANS), model=LiSnowNet(small_grid, width=2))
    assert {frame.label_path for frame in data.frames("train")} == {None}
    assert {batch.target for batch in batches(data, "train")} == {None}
    assert {scan.label for scan in data.training_scans(SCANS, labelled=False)} == {None}
    (tmp_path / "2.label").unlink()
    (batch,) = batches(data, "val")
    labelled = [measured.scan.label is not None for measured in batch.measured]
    assert labelled == [True, True, False, True, True, True]
    assert batch.target is None  # there is none for all of them


@pytest.mark.parametrize("part", ["train", "validation", "test"])
def test_a_model_that_learns_from_labels_needs_them_all(folder, connect, tmp_path, part) -> None:
    data = connect(folder())
    (tmp_path / "2.label").unlink()
    with pytest.raises(InputError, match=r"2\.bin: its labels are not at .*data card"):
        data.frames(part)
    assert len(data.frames("predict")) == SCANS


@pytest.mark.parametrize(
    # The last of the scans, for a worker that is left in the middle takes seconds to end.
    ("workers", "file", "content", "message"),
    [
        (0, "5.label", np.resize([778, 0, 777], 45), r"ids \[777, 778\] are no classes of WADS"),
        (1, "5.label", np.zeros(2), "holds 2 labels of 4 bytes for a scan of 45 points"),
        (0, "5.bin", np.zeros(1), "4 bytes are not whole rows of 16 bytes"),
    ],
    ids=["unknown class", "short labels", "half a row"],
)
def test_a_file_that_cannot_be_used_is_named_from_a_worker_as_well(
    folder, connect, tmp_path, workers, file, content, message
) -> None:
    data = connect(folder(workers=workers))
    content.astype("<u4").tofile(tmp_path / file)
    with pytest.raises(InputError, match=f"{re.escape(file)}: {message}") as refusal:
        batches(data, "val")
    assert "Traceback" not in str(refusal.value)
