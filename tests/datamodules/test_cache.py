"""What is kept from epoch to epoch: the same batches as without, and no more than there is room."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest
import torch

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.datamodules.loader import scan_loader
from derain.datamodules.scan_data import Part
from derain.datamodules.scan_dataset import Cache
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.scan import Scan

NOTHING = Augmentation(0, 0)
EVERYTHING = Augmentation(1, 1, mirror_probability=1, dropping_probability=1)


def scan_of(points: int) -> Scan:
    return Scan.of(scene(points)).with_label(np.zeros(points, np.int64))


def test_what_came_first_stays_as_long_as_it_fits() -> None:
    made: list[int] = []

    def item(number: int) -> Scan:
        made.append(number)
        return scan_of(1000)

    kept = Cache(80_000)  # 24,000 bytes a scan, and a little more
    for _ in range(2):
        for number in range(5):
            kept.get(number, lambda n=number: item(n))
    assert made == [0, 1, 2, 3, 4, 3, 4]


def epochs(data: Folder, part: Part, loading: Loading) -> Iterator[Batch]:
    loader = scan_loader(data.source(part), part, data.task, loading)
    for epoch in range(3):
        loader.sampler.set_epoch(epoch)
        yield from loader


@pytest.mark.parametrize("augmentation", [NOTHING, EVERYTHING], ids=["still", "changed"])
@pytest.mark.parametrize(("part", "workers"), [("train", 0), ("train", 2), ("validation", 0)])
def test_keeping_changes_no_batch(folder, connect, part, augmentation, workers) -> None:
    data = connect(folder())
    kept = epochs(data, part, Loading(workers=workers, augmentation=augmentation))
    anew = epochs(data, part, Loading(augmentation=augmentation, cache_mb=0))
    for one, other in zip(kept, anew, strict=True):
        for name, tensor in other.inputs.items():
            assert torch.equal(one.inputs[name], tensor)
        assert torch.equal(one.target, other.target)
        assert [m.key for m in one.measured] == [m.key for m in other.measured]


@pytest.mark.parametrize(("megabytes", "times"), [(0, 3), (1, 1)])
@pytest.mark.parametrize("part", ["train", "validation"])
def test_scans_are_read_once_where_there_is_room(
    folder, connect, part, megabytes, times, monkeypatch
) -> None:
    from derain.sources.reader import FrameReader

    data, read, original = connect(folder()), [], FrameReader.read_unlabelled

    def counted(self: FrameReader, frame: Any) -> Scan:
        read.append(frame.name)
        return original(self, frame)

    monkeypatch.setattr(FrameReader, "read_unlabelled", counted)
    list(epochs(data, part, Loading(augmentation=EVERYTHING, cache_mb=megabytes)))
    assert len(read) == times * 6
