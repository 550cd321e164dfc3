"""Checkpoints of training runs are written whole or not at all."""

import math
import tempfile
from collections.abc import Callable
from pathlib import Path

import pytest
import torch
from lightning.pytorch.plugins.io import TorchCheckpointIO

from derain.errors import InputError
from derain.models.checkpoint import WholeCheckpoints, load_model, save_model
from derain.models.outdet import OutDet


def test_nothing_is_written_outside_the_folder(
    outdet: Callable[..., OutDet], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(tempfile, "tempdir", str(tmp_path / "none"))
    save_model(outdet(), tmp_path / "runs" / "model.ckpt")
    assert list((tmp_path / "runs").iterdir()) == [tmp_path / "runs" / "model.ckpt"]
    load_model(tmp_path / "runs" / "model.ckpt")


def test_the_checkpoint_that_is_there_stays_until_the_next_is_whole(
    outdet: Callable[..., OutDet], tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    path = tmp_path / "model.ckpt"
    save_model(outdet(seed=0), path)
    before = path.read_bytes()

    def cut_short(file: Path, content: memoryview) -> int:
        with file.open("wb") as stream:
            stream.write(content[:1000])
        assert path.read_bytes() == before
        raise KeyboardInterrupt

    monkeypatch.setattr(Path, "write_bytes", cut_short)
    with pytest.raises(KeyboardInterrupt):
        save_model(outdet(seed=1), path)
    assert path.read_bytes() == before
    assert list(tmp_path.iterdir()) == [path]


@pytest.mark.parametrize("value", [math.nan, math.inf])
def test_weights_that_are_not_finite_take_no_checkpoints_place(
    tmp_path: Path, value: float
) -> None:
    path = tmp_path / "best.ckpt"
    path.write_bytes(b"the last good one")
    with pytest.raises(InputError, match=r"best\.ckpt: the weights head are not finite"):
        WholeCheckpoints().save_checkpoint({"state_dict": {"head": torch.tensor(value)}}, path)
    assert path.read_bytes() == b"the last good one"


def test_an_address_is_left_to_lightning() -> None:
    checkpoints = WholeCheckpoints()
    checkpoints.save_checkpoint({"epoch": 3}, "memory://runs/model.ckpt")
    assert checkpoints.load_checkpoint("memory://runs/model.ckpt") == {"epoch": 3}


def test_a_checkpoint_holds_what_lightning_would_write(tmp_path: Path) -> None:
    content = {"state_dict": {"weight": torch.arange(3.0)}, "epoch": 2}
    for writer, name in ((WholeCheckpoints(), "ours"), (TorchCheckpointIO(), "lightning")):
        writer.save_checkpoint(content, tmp_path / name)
    assert (tmp_path / "ours").read_bytes() == (tmp_path / "lightning").read_bytes()
