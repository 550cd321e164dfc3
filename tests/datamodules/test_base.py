"""From files to batches: what a model gets to see, and what is said of files it cannot see."""

import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from derain.cards.card import load_card
from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading, ScanDataModule
from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.models.lisnownet import LiSnowNet
from derain.scan import Scan
from derain.views.neighbours import NeighbourView

Write = Callable[..., None]
Connect = Callable[..., ScanDataModule]
STILL = Augmentation(rotation_probability=0, jitter_probability=0)
SCANS = 6
SNOW = 110


@pytest.fixture
def folder(tmp_path: Path, write: Write) -> Callable[..., Folder]:
    """Makes a data module of six scans, of 40, 41, ... points."""
    for number in range(SCANS):
        file = tmp_path / f"{number}.bin"
        write(file, file.with_suffix(".label"), [0, SNOW, 111], scene(40 + number, seed=number))

    def make(**loading: Any) -> Folder:
        everything = {part: ["*.bin"] for part in ("train", "validation", "test")}
        return Folder(str(tmp_path), "wads", **everything, loading=Loading(**loading))

    return make


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


def lengths(data: ScanDataModule, part: str) -> list[int]:
    return [len(scan) for scan in scans(data, part)]


def test_what_is_not_trained_on_comes_in_order_and_untouched(
    folder: Callable[..., Folder], connect: Connect
) -> None:
    data = connect(folder())
    for part in ("val", "test", "predict"):
        for _ in range(2):
            for number, scan in enumerate(scans(data, part)):
                points = scene(40 + number, seed=number)
                np.testing.assert_array_equal(np.c_[scan.xyz, scan.intensity], points)
    assert {batch.target for batch in batches(data, "predict")} == {None}


def test_scans_are_packed_in_batches_of_the_size_asked_for(
    folder: Callable[..., Folder], connect: Connect
) -> None:
    first, second = batches(connect(folder(batch_size=4)), "val")
    assert (first.cells, second.cells) == ([40, 41, 42, 43], [44, 45])
    assert len(first.inputs["points"]) == 40 + 41 + 42 + 43


def test_the_target_is_one_where_the_card_says_rain(
    folder: Callable[..., Folder], connect: Connect
) -> None:
    for batch in batches(connect(folder()), "val"):
        (measured,) = batch.measured
        assert measured.scan.label is not None
        assert batch.target is not None
        expected = measured.scan.label[NeighbourView()(measured.scan).first] == SNOW
        np.testing.assert_array_equal(batch.target.numpy(), expected)
        assert 0 < expected.sum() < len(expected)


@pytest.mark.parametrize("neighbours", [3, 9])
def test_the_view_is_the_models(
    folder: Callable[..., Folder], connect: Connect, neighbours: int
) -> None:
    batch = batches(connect(folder(), neighbours), "val")[0]
    assert batch.inputs["neighbours"].shape == (40, neighbours)
    expected = NeighbourView(neighbours)(batch.measured[0].scan)
    np.testing.assert_array_equal(batch.inputs["neighbours"], expected.neighbours)
    np.testing.assert_array_equal(batch.inputs["distances"], expected.distances)


def test_a_worker_gives_what_the_process_itself_gives(
    folder: Callable[..., Folder], connect: Connect
) -> None:
    here, there = (batches(connect(folder(workers=workers)), "val") for workers in (0, 1))
    for own, sent in zip(here, there, strict=True):
        for name, tensor in own.inputs.items():
            assert torch.equal(tensor, sent.inputs[name])
        assert own.target is not None
        assert torch.equal(own.target, sent.target)


def test_a_data_set_can_be_sent_to_a_worker(
    folder: Callable[..., Folder], connect: Connect
) -> None:
    # Where processes do not fork, workers get the data set by pickling.
    dataset: Any = connect(folder(deduplicate=True)).val_dataloader().dataset
    sent = pickle.loads(pickle.dumps(dataset))
    assert len(sent) == SCANS
    np.testing.assert_array_equal(sent[3].view.points, dataset[3].view.points)


@pytest.mark.parametrize("loading", [{}, {"batch_size": 4}, {"deduplicate": True}], ids=str)
def test_duplicates_are_measured_once_and_every_row_is_predicted(
    tmp_path: Path, write: Write, connect: Connect, loading: dict[str, Any]
) -> None:
    distinct = scene(30)
    rows = np.random.default_rng(0).permutation(np.resize(np.arange(30), 75))
    points = np.concatenate([distinct[rows], np.full((5, 4), np.nan, np.float32)])
    write(tmp_path / "a.bin", tmp_path / "a.label", [0, SNOW], points)
    parts = {part: ["a.bin"] for part in ("train", "validation", "test")}
    still = Loading(augmentation=STILL, **loading)  # the data card asks for it where this does not
    data = connect(Folder(str(tmp_path), "wads", **parts, loading=still))
    for part in ("train", "val", "test"):
        (scan,) = scans(data, part)
        # The rows that remain are the first of their kind, in the order of the file.
        first = np.sort(np.unique(rows, return_index=True)[1])
        np.testing.assert_array_equal(scan.xyz, points[first, :3])
        np.testing.assert_array_equal(scan.label, np.resize([0, SNOW], 80)[first])
    ((measured,),) = (batch.measured for batch in batches(data, "predict"))
    score = np.arange(1, 31, dtype=np.float32)
    back = measured.back_projection(score)
    assert len(back) == 80
    np.testing.assert_array_equal(back[75:], 0)
    assert len(set(back[:75].tolist())) == 30
    for row in range(30):
        assert len(set(back[:75][rows == row].tolist())) == 1


@pytest.mark.parametrize(("card", "asked"), [("kitti", None), ("wads", False)])
def test_without_asking_duplicates_are_counted_as_often_as_they_are_there(
    tmp_path: Path, write: Write, connect: Connect, card: str, asked: bool | None
) -> None:
    write(tmp_path / "a.bin", tmp_path / "a.label", [0], np.repeat(scene(10), 3, axis=0))
    loading = Loading(deduplicate=asked)
    data = connect(Folder(str(tmp_path), card, train=["a.bin"], test=["a.bin"], loading=loading))
    assert lengths(data, "test") == [30]


def test_statistics_are_taken_from_the_training_scans_where_the_card_has_none(
    tmp_path: Path, write: Write
) -> None:
    for number in range(3):
        file = tmp_path / f"{number}.bin"
        write(file, file.with_suffix(".label"), [3, 0, 0, 0], scene(40, seed=number))
    data = Folder(str(tmp_path), "simulated", train=["[01].bin"], test=["2.bin"])
    assert not data.card.has_statistics
    data.complete_card()
    points = np.concatenate([scene(40, seed=0), scene(40, seed=1)]).astype(np.float64)
    np.testing.assert_allclose(data.card.mean, points.mean(axis=0))
    np.testing.assert_allclose(data.card.std, points.std(axis=0))
    assert data.card.rain_share == 0.25
    card = data.card
    data.complete_card()
    assert data.card is card  # what it says is left alone


@pytest.fixture
def unsupervised(small_grid: dict[str, Any], connect: Connect) -> Connect:
    """Has a data module agree with a model that does not learn from labels."""
    return lambda data: connect(data, model=LiSnowNet(small_grid, width=2))


def test_a_model_that_learns_from_no_labels_gets_none_to_train_on(
    folder: Callable[..., Folder], unsupervised: Connect
) -> None:
    data = unsupervised(folder())
    assert {frame.label_path for frame in data.frames("train")} == {None}
    assert {batch.target for batch in batches(data, "train")} == {None}
    scans = data.training_scans(SCANS, labelled=False)
    assert {scan.label for scan in scans} == {None}


def test_such_a_model_is_validated_on_the_labels_that_there_are(
    folder: Callable[..., Folder], unsupervised: Connect, tmp_path: Path
) -> None:
    data = unsupervised(folder(batch_size=SCANS))
    (tmp_path / "2.label").unlink()
    (batch,) = batches(data, "val")
    labelled = [measured.scan.label is not None for measured in batch.measured]
    assert labelled == [True, True, False, True, True, True]
    assert batch.target is None  # there is none for all of them
    with pytest.raises(InputError, match=r"2\.bin: its labels are not at"):
        data.frames("test")


@pytest.mark.parametrize("part", ["train", "validation", "test"])
def test_a_model_that_learns_from_labels_needs_them_all(
    folder: Callable[..., Folder], connect: Connect, tmp_path: Path, part: Any
) -> None:
    data = connect(folder())
    (tmp_path / "2.label").unlink()
    with pytest.raises(InputError, match=r"2\.bin: its labels are not at .*data card"):
        data.frames(part)
    assert len(data.frames("predict")) == SCANS


@pytest.mark.parametrize("card", ["simulated", "rehearse3d"])
def test_statistics_but_not_the_share_of_rain_are_measured_without_labels(
    tmp_path: Path, write: Write, unsupervised: Connect, card: str
) -> None:
    write(tmp_path / "0.bin", points=scene(40))
    data = unsupervised(Folder(str(tmp_path), card, train=["0.bin"]))
    np.testing.assert_allclose(data.card.mean, scene(40).astype(np.float64).mean(axis=0))
    assert data.card.rain_share == load_card(card).rain_share


def test_range_images_of_a_batch_have_one_size(
    folder: Callable[..., Folder], unsupervised: Connect
) -> None:
    data = unsupervised(folder(batch_size=SCANS))
    view = data.task.make_view()
    (batch,) = batches(data, "val")
    assert batch.inputs["image"].shape == (SCANS, 3, 18, 60)
    assert batch.inputs["valid"].shape == (SCANS, 1, 18, 60)
    for number, measured in enumerate(batch.measured):
        image = torch.from_numpy(view(measured.scan).image)
        assert torch.equal(batch.inputs["image"][number], image)


@pytest.mark.parametrize("workers", [0, 1])
@pytest.mark.parametrize(
    # The last of the scans, for a worker that is left in the middle takes seconds to end.
    ("file", "content", "message"),
    [
        (
            "5.label",
            np.resize([778, 0, 777], 45),
            r"ids \[777, 778\] are no classes of WADS",
        ),
        ("5.label", np.zeros(2), "holds 2 labels of 4 bytes for a scan of 45 points"),
        ("5.bin", np.zeros(1), "4 bytes are not whole rows of 16 bytes"),
    ],
    ids=["unknown class", "short labels", "half a row"],
)
def test_a_file_that_cannot_be_used_is_named_from_a_worker_as_well(
    folder: Callable[..., Folder],
    connect: Connect,
    tmp_path: Path,
    file: str,
    content: np.ndarray,
    message: str,
    workers: int,
) -> None:
    data = connect(folder(workers=workers))
    content.astype("<u4").tofile(tmp_path / file)
    with pytest.raises(InputError, match=f"{re.escape(file)}: {message}") as refusal:
        batches(data, "val")
    assert "Traceback" not in str(refusal.value)
