"""A network that sees the place of returns in their rays sees it in deployment, too."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import torch

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.files import write_scan
from derain.files.labels import write_labels
from derain.learning.task import agree_on_task
from derain.models.checkpoint import load_model, save_model
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.views.channels import DUAL_RETURN, channel_of

from ..two_returns import Recording


def recorded(seed: int, share: float = 0.2) -> Scan:
    """A scan of a sensor of two returns, each of one intensity."""
    recording = Recording(seed, share, step=3.0)
    return Scan.of(np.column_stack([recording.xyz, recording.ray % 200]))


@pytest.fixture(scope="module")
def checkpoint(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Checkpoint of a network that knows the statistics of two recordings."""
    folder = tmp_path_factory.mktemp("dual")
    for seed in range(2):
        scan = recorded(seed)
        write_scan(folder / f"{seed}.npz", scan)
        write_labels(folder / f"{seed}.label", np.where(np.arange(len(scan)) % 4, 0, 110))
    data = Folder(str(folder), "wads", train=["*.npz"], loading=Loading(batch_size=2))
    torch.manual_seed(0)
    model = OutDet(channels=("x", "y", "z", DUAL_RETURN))
    agree_on_task(model, data)
    save_model(model, folder / "model.ckpt")
    return folder / "model.ckpt"


@pytest.fixture(scope="module")
def derainer(checkpoint: Path) -> Derainer:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr("derain.export.onnx_file.hard_cases", lambda: [("dual", recorded(3))])
        patch.setattr("derain.models.outdet.deployed.BLOCKS", 1)  # traced several times as quickly
        export(load_model(checkpoint), checkpoint.with_suffix(".onnx"))
    return Derainer(checkpoint.with_suffix(".onnx"), threads=1)


def test_the_file_answers_as_the_network_of_the_same_channel(
    checkpoint: Path, derainer: Derainer
) -> None:
    places = np.concatenate([channel_of(recorded(seed), DUAL_RETURN) for seed in range(2)])
    spec = derainer.spec
    assert spec.units == ("m", "m", "m", "-1, 0 or 1")
    assert spec.mean[-1] == pytest.approx(places.mean(), abs=1e-6)
    assert spec.std[-1] == pytest.approx(places.std(), rel=1e-5)
    scan = recorded(7)
    model = load_model(checkpoint)
    view = model.spec.make_view()(scan)
    np.testing.assert_array_equal(view.points[:, 3], channel_of(scan, DUAL_RETURN)[view.first])
    with torch.inference_mode():
        logits = model(**{name: torch.from_numpy(a) for name, a in view.inputs().items()})
    expected = view.back(logits.softmax(dim=1)[:, 1].numpy())
    np.testing.assert_allclose(derainer.probability(scan), expected, atol=1e-4)
    blind = replace(scan, fields={DUAL_RETURN: np.zeros(len(scan), np.float32)})
    assert (derainer.probability(scan) != derainer.probability(blind)).mean() > 0.1
    single = recorded(7, share=0)
    assert set(spec.missing_channels(single)) == {DUAL_RETURN}
    assert spec.missing_channels(scan) == {}
