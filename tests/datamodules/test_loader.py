"""Loaders without a data module give what a data module's give."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest
import torch

from derain.datamodules.augmentation import Augmentation
from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.datamodules.loader import scan_loader
from derain.evaluation.hard_cases import scene

LOADING = Loading(batch_size=2, augmentation=Augmentation(1, 1, dropping_probability=1))


@pytest.fixture
def data(tmp_path: Path, write: Callable[..., None], connect: Callable[..., Any]) -> Folder:
    for number in range(5):
        path = tmp_path / f"{number}.bin"
        write(path, path.with_suffix(".label"), [0, 110], scene(40 + number, seed=number))
    parts = {part: ["*.bin"] for part in ("train", "validation", "test")}
    return connect(Folder(str(tmp_path), "wads", **parts, loading=LOADING))


@pytest.mark.parametrize("part", ["train", "val", "test", "predict"])
def test_a_loader_of_a_source_gives_the_batches_of_the_data_module(data: Folder, part: Any) -> None:
    name = "validation" if part == "val" else part
    own = scan_loader(data.source(name), name, data.task, LOADING)
    theirs = getattr(data, f"{part}_dataloader")()
    for epoch in range(2):
        own.sampler.set_epoch(epoch)
        theirs.sampler.set_epoch(epoch)
        batches = list(zip(own, theirs, strict=True))
        assert len(batches) == 3
        for one, other in batches:
            assert one.cells == other.cells
            assert [m.key for m in one.measured] == [m.key for m in other.measured]
            for key, tensor in one.inputs.items():
                assert torch.equal(tensor, other.inputs[key])


def test_two_processes_share_the_scans(data: Folder) -> None:
    loaders = [
        scan_loader(data.source("test"), "test", data.task, LOADING, processes=2, process=own)
        for own in range(2)
    ]
    keys = [[m.key for batch in loader for m in batch.measured] for loader in loaders]
    assert keys == [["0", "1", "4"], ["2", "3"]]
