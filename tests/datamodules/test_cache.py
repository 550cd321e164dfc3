"""What is kept from epoch to epoch: the same batches as without, and no more than there is room."""

from collections.abc import Callable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.datamodules.loader import scan_loader
from derain.datamodules.scan_data import Part
from derain.datamodules.scan_dataset import Cache, bytes_of
from derain.evaluation.hard_cases import scene
from derain.learning.batch import Batch
from derain.scan import Scan

NOTHING = Augmentation(0, 0)
EVERYTHING = Augmentation(1, 1, mirror_probability=1, dropping_probability=1)
SCANS = 3


def scan_of(points: int) -> Scan:
    return Scan.of(scene(points)).with_label(np.zeros(points, np.int64))


def test_all_arrays_of_a_scan_count() -> None:
    scan = scan_of(100)
    assert bytes_of(scan) == 100 * (12 + 4 + 8)
    assert scan.range.nbytes == 400  # kept by the scan from now on
    assert bytes_of(scan) == 100 * (12 + 4 + 8 + 4)


def test_what_came_first_stays_as_long_as_it_fits() -> None:
    made: list[int] = []

    def item(number: int) -> Scan:
        made.append(number)
        return scan_of(100 if number != 1 else 1000)

    kept = Cache(3 * bytes_of(scan_of(100)))
    for _ in range(2):
        for number in range(5):
            assert len(kept.get(number, lambda n=number: item(n))) == len(item(number))
    once = [number for number in range(5) if made.count(number) == 3]
    assert once == [0, 2, 3]  # 1 is too large, and for 4 nothing is left
    assert made.count(1) == made.count(4) == 4


@pytest.fixture
def data(tmp_path: Path, write: Callable[..., None], connect: Callable[..., Any]) -> Folder:
    for number in range(SCANS):
        path = tmp_path / f"{number}.bin"
        write(path, path.with_suffix(".label"), [0, 110], scene(40 + number, seed=number))
    folder: Folder = connect(Folder(str(tmp_path), "wads", ["*.bin"], ["*.bin"], ["*.bin"]))
    return folder


def epochs(data: Folder, part: Part, loading: Loading) -> Iterator[Batch]:
    assert data.task is not None
    loader = scan_loader(data.source(part), part, data.task, loading)
    for epoch in range(3):
        loader.sampler.set_epoch(epoch)  # type: ignore[attr-defined]
        yield from loader  # type: ignore[misc]


@pytest.mark.parametrize("augmentation", [NOTHING, EVERYTHING], ids=["still", "changed"])
@pytest.mark.parametrize("part", ["train", "validation"])
@pytest.mark.parametrize("workers", [0, 2])
def test_keeping_changes_no_batch(
    data: Folder, part: Part, augmentation: Augmentation, workers: int
) -> None:
    kept = epochs(data, part, Loading(workers=workers, augmentation=augmentation))
    anew = epochs(data, part, Loading(augmentation=augmentation, cache_mb=0))
    for one, other in zip(kept, anew, strict=True):
        for name, tensor in other.inputs.items():
            assert torch.equal(one.inputs[name], tensor)
        assert one.target is not None
        assert other.target is not None
        assert torch.equal(one.target, other.target)
        assert [m.key for m in one.measured] == [m.key for m in other.measured]


@pytest.mark.parametrize(("megabytes", "reads"), [(0, 3 * SCANS), (1, SCANS)])
@pytest.mark.parametrize("part", ["train", "validation"])
def test_scans_are_read_once_where_there_is_room(
    data: Folder, part: Part, megabytes: int, reads: int, monkeypatch: pytest.MonkeyPatch
) -> None:
    from derain.sources.reader import FrameReader

    read: list[str] = []
    original = FrameReader.read_unlabelled

    def counted(self: FrameReader, frame: Any) -> Scan:
        read.append(frame.name)
        return original(self, frame)

    monkeypatch.setattr(FrameReader, "read_unlabelled", counted)
    list(epochs(data, part, Loading(augmentation=EVERYTHING, cache_mb=megabytes)))
    assert len(read) == reads


@pytest.mark.parametrize("augmentation", [NOTHING, EVERYTHING])
def test_what_is_kept_takes_no_time_to_read(data: Folder, augmentation: Augmentation) -> None:
    loading = Loading(batch_size=2, augmentation=augmentation)
    task = data.task
    assert task is not None
    loader = scan_loader(data.source("train"), "train", task, loading)
    first, second = ([batch.milliseconds for batch in loader] for _ in range(2))
    assert len(first) == len(second) == 2
    assert all(times["read"] > 0 and times["view"] > 0 for times in first)
    assert all("read" not in times and times["view"] > 0 for times in second)
