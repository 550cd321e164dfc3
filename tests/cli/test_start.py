"""What a training may start from, and what is refused."""

from pathlib import Path

import lightning
import pytest
import torch

from derain import default
from derain.cards.card import load_card
from derain.errors import InputError
from derain.learning.start import STARTED_FROM, checkpoint_of
from derain.models.checkpoint import load_model, save_model
from derain.models.outdet import OutDet


def trained(path: Path) -> OutDet:
    """A blind network, as far as a checkpoint is concerned."""
    lightning.seed_everything(0)
    model = OutDet(neighbours=4, channels=("range",))
    model.adopt(model.spec_for(load_card("wads")))
    save_model(model, path)
    return model


@pytest.mark.parametrize(
    "command",
    [
        ["export", "outdet.onnx", "--out", "model.onnx"],
        ["fit", "--config", "outdet_wads.yaml", "--start", "outdet.onnx"],
        ["fit", "--config", "outdet_wads.yaml", "--ckpt_path", "outdet.onnx"],
    ],
)
def test_an_onnx_file_is_refused_by_the_name_of_its_checkpoint(refused, here, command) -> None:
    (here / "outdet.onnx").write_bytes(b"graph")
    line = refused(*command)
    assert line.startswith("derain: outdet.onnx: is an ONNX file, ")
    assert line.index("student.ckpt ") < line.index("best.ckpt ")


def test_default_is_the_checkpoint_that_derain_comes_with(tmp_path, monkeypatch) -> None:
    monkeypatch.setattr(default, "FOLDER", tmp_path)
    with pytest.raises(InputError, match=r"comes with derain is missing\. Install derain again"):
        checkpoint_of("default")
    trained(tmp_path / "model.ckpt")
    assert checkpoint_of("default") == tmp_path / "model.ckpt"


def test_fit_begins_with_the_weights_of_its_start(succeed, here, wads) -> None:
    source = trained(here / "start.ckpt")
    # At a rate of nothing, it ends where it began.
    still = ("--model.learning_rate", "0", "--model.weight_decay", "0", "--trainer.max_epochs", "1")
    succeed("fit", *wads, "--start", "start.ckpt", *still, "--panels.scans", "1")
    run = Path("runs/outdet_wads/version_0")
    student = load_model(run / "checkpoints/last.ckpt")
    for name, parameter in source.named_parameters():
        torch.testing.assert_close(student.get_parameter(name), parameter, rtol=0, atol=0)
    (name,) = student.spec.training[STARTED_FROM]
    assert name.startswith("start.ckpt (")
    assert student.hparams["learning_rate"] == 0
    assert "start: start.ckpt" in (run / "config.yaml").read_text()
    # A training goes on from its checkpoints as from any other.
    last = ("--ckpt_path", run / "checkpoints/last.ckpt")
    more = ("--start", "start.ckpt", *still[:-1], "2")
    succeed("fit", *wads, *more, *last)
