"""3D-OutDet made relative: what it says of a scan, alone and among others, trained and exported."""

from dataclasses import replace
from pathlib import Path

import lightning
import numpy as np
import pytest
import torch
from lightning.pytorch.callbacks import ModelCheckpoint

from derain.cards.card import load_card
from derain.datamodules.in_memory import InMemory
from derain.datamodules.scan_data import Loading
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.candidates import fit_network_candidates
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.learning.batch import Batch, Sample
from derain.models.relative_outdet import RelativeOutDet
from derain.scan import Scan
from derain.views.candidates import Bound, Candidates


def labelled(seed: int, drops: int = 300) -> Scan:
    """A scene with drops in the air: WADS's falling snow."""
    generator = np.random.default_rng(seed)
    flying = np.concatenate([generator.uniform(-8, 8, (drops, 3)), np.zeros((drops, 1))], axis=1)
    points = np.concatenate([scene(3000), flying])
    return Scan.of(points).with_label(np.repeat([40, 110], [3000, drops]))


@pytest.fixture(scope="module")
def trained() -> RelativeOutDet:
    """Trained on a few scenes."""
    lightning.seed_everything(0)
    model = RelativeOutDet(learning_rate=1e-2)
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


def test_it_learns_drops_and_is_blind_to_intensity(trained: RelativeOutDet, tmp_path: Path) -> None:
    export(trained, tmp_path / "model.onnx")
    derainer = Derainer(str(tmp_path / "model.onnx"))
    scan = labelled(20)
    called, rain = derainer(scan), scan.label == 110
    assert (called & rain).sum() / (called | rain).sum() > 0.6
    bright = replace(scan, intensity=np.full(len(scan), 200, np.float32))
    np.testing.assert_array_equal(derainer(bright), called)


def test_scans_of_a_batch_say_nothing_to_each_other(trained: RelativeOutDet) -> None:
    view = trained.spec.make_view(threads=1)
    scans = [labelled(1), labelled(2, drops=5), Scan.of(scene(40))]
    samples = [Sample(scan, view(scan), None) for scan in scans]
    with torch.no_grad():
        together = trained.logits_of(Batch.of(samples))
        alone = [trained.logits_of(Batch.of([sample])) for sample in samples]
    torch.testing.assert_close(together, torch.cat(alone))


def test_it_takes_no_candidates(trained: RelativeOutDet) -> None:
    """What it says of a point depends on all the others, so that none may be left out."""
    candidates = Candidates((Bound("range", most=20.0),))
    view = trained.spec.make_view()
    assert trained.accepts_view(view)
    assert not trained.accepts_view(view.with_candidates(candidates))
    with pytest.raises(InputError, match="relative_outdet"):
        RelativeOutDet().adopt(replace(trained.spec, candidates=candidates))
    with pytest.raises(InputError, match="--candidates: relative_outdet judges every point alike"):
        fit_network_candidates(trained, [labelled(3)], load_card("wads"))


def test_too_small_a_neighbourhood_is_refused() -> None:
    with pytest.raises(InputError, match="neighbours"):
        RelativeOutDet(neighbours=3)


def test_a_training_of_one_cycle_goes_on_with_steps_of_as_many_scans_alone(tmp_path: Path) -> None:
    scans = [labelled(seed) for seed in range(2)]

    def fit(batch_size: int, checkpoint: Path | None = None) -> lightning.Trainer:
        every = ModelCheckpoint(tmp_path, filename="{epoch}", save_top_k=-1)
        trainer = lightning.Trainer(
            max_epochs=2, callbacks=[every], logger=False, enable_progress_bar=False
        )
        data = InMemory(scans, scans, card="wads", loading=Loading(batch_size=batch_size))
        trainer.fit(RelativeOutDet(), data, ckpt_path=checkpoint)
        return trainer

    assert fit(batch_size=2).global_step == 2
    first = tmp_path / "epoch=0.ckpt"
    assert fit(batch_size=2, checkpoint=first).global_step == 2
    with pytest.raises(InputError, match="learning rate for 2 steps, where this run takes 4"):
        fit(batch_size=1, checkpoint=first)
