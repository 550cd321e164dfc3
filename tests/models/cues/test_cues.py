"""Cues: what the network makes of a scan's brightness, in whatever unit, order and direction."""

from dataclasses import replace
from pathlib import Path

import lightning
import numpy as np
import pytest
import torch

from derain.datamodules.in_memory import InMemory
from derain.datamodules.scan_data import Loading
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.learning.batch import Batch, Sample
from derain.models.checkpoint import load_model, save_model
from derain.models.cues import CuedOutDet
from derain.models.outdet import OutDet
from derain.models.relative_outdet import RelativeOutDet
from derain.models.start import started
from derain.scan import Scan


def labelled(seed: int, drops: int = 300, gain: float = 1.0) -> Scan:
    """A bright scene with dim drops in the air."""
    generator = np.random.default_rng(seed)
    ground = np.concatenate([scene(3000)[:, :3], generator.uniform(50, 255, (3000, 1))], axis=1)
    flying = generator.uniform(-8, 8, (drops, 3))
    dim = np.concatenate([flying, generator.uniform(0, 10, (drops, 1))], axis=1)
    points = np.concatenate([ground, dim]) * [1, 1, 1, gain]
    return Scan.of(points.astype(np.float32)).with_label(np.repeat([40, 110], [3000, drops]))


@pytest.fixture(scope="module")
def trained() -> CuedOutDet:
    """Trained on a few scenes, geometry and fusion together."""
    lightning.seed_everything(0)
    model = CuedOutDet(learning_rate=1e-2)
    data = InMemory(
        train=[labelled(seed) for seed in range(4)],
        validation=[labelled(9)],
        card="wads",
        loading=Loading(batch_size=2),
    )
    trainer = lightning.Trainer(
        max_epochs=25, logger=False, enable_progress_bar=False, enable_checkpointing=False
    )
    trainer.fit(model, data)
    return model.eval()


@pytest.fixture(scope="module")
def exported(trained: CuedOutDet, tmp_path_factory: pytest.TempPathFactory) -> Derainer:
    path = tmp_path_factory.mktemp("cues") / "model.onnx"
    assert export(trained, path).holds
    return Derainer(path, threads=1)


def test_brightness_helps_whatever_its_unit(exported: Derainer) -> None:
    scan = labelled(20)
    rain = scan.label == 110
    called = exported(scan)

    def iou(answer: np.ndarray) -> float:
        return float((answer & rain).sum() / (answer | rain).sum())

    assert iou(called) > 0.9
    np.testing.assert_array_equal(exported(labelled(20, gain=1 / 255)), called)
    alike = exported(replace(scan, intensity=np.full(len(scan), 7, np.float32)))
    assert iou(alike) < iou(called) - 0.05


def test_rows_in_another_order_are_judged_alike(exported: Derainer) -> None:
    scan = labelled(21)
    order = np.random.default_rng(0).permutation(len(scan))
    shuffled = exported.probability(scan.take(order))
    np.testing.assert_allclose(shuffled, exported.probability(scan)[order], atol=1e-4)


def test_scans_of_a_batch_say_nothing_to_each_other(trained: CuedOutDet) -> None:
    view = trained.spec.make_view()
    scans = [labelled(30), labelled(31, drops=30)]
    samples = [
        Sample.of(scan, view(scan), trained.card, key=str(n)) for n, scan in enumerate(scans)
    ]
    together = trained.logits_of(Batch.of(samples))
    apart = torch.cat([trained.logits_of(Batch.of([sample])) for sample in samples])
    torch.testing.assert_close(together, apart)


def test_a_checkpoint_gives_the_same(trained: CuedOutDet, tmp_path: Path) -> None:
    save_model(trained, tmp_path / "model.ckpt")
    again = load_model(tmp_path / "model.ckpt")
    assert again.spec == trained.spec
    assert isinstance(again, CuedOutDet)
    for own, other in zip(trained.state_dict().values(), again.state_dict().values(), strict=True):
        torch.testing.assert_close(own, other, rtol=0, atol=0)


def test_it_starts_from_a_trained_geometry_and_may_leave_that_as_it_is(
    trained: CuedOutDet, tmp_path: Path
) -> None:
    geometry = RelativeOutDet(width=16)
    geometry.adopt(replace(_of_geometry(trained), network="relative_outdet"))
    save_model(geometry, tmp_path / "geometry.ckpt")
    model = started(CuedOutDet(geometry_share=0.0), tmp_path / "geometry.ckpt", "geometry")
    assert model.hparams["width"] == 16
    weights = model.network.geometry.state_dict()
    for name, weight in geometry.network.state_dict().items():
        torch.testing.assert_close(weights[name], weight)
    learning = {id(weight) for group in model.parameter_groups() for weight in group["params"]}
    assert not learning & {id(weight) for weight in model.network.geometry.parameters()}


def _of_geometry(model: CuedOutDet) -> object:
    """The Spec of a model that sees geometry alone."""
    spec = model.spec
    return replace(
        spec,
        view={"kind": "neighbours", "neighbours": 9},
        channels=spec.channels[:3],
        units=spec.units[:3],
        mean=spec.mean[:3],
        std=spec.std[:3],
    )


def test_it_needs_its_neighbours_and_a_start_of_its_kind() -> None:
    with pytest.raises(InputError, match="neighbours: 8 are too few"):
        CuedOutDet(neighbours=8)
    with pytest.raises(InputError, match="from which cued_outdet cannot start"):
        CuedOutDet().begin_from(OutDet())
