"""A network is trained and measured alike on files, on scans in memory and by plain loaders."""

from collections.abc import Callable
from pathlib import Path

import lightning
import numpy as np
import pytest
import torch
from recorded_scenes import write_scenes
from torch.utils.data import DataLoader

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.datamodules.in_memory import InMemory
from derain.datamodules.loader import scan_loader
from derain.datamodules.scan_check import ScanCheck
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.learning.task import agree_on_task
from derain.models.base import DerainingModule
from derain.models.callbacks.panels import Panels
from derain.models.callbacks.report import TestReport
from derain.models.lisnownet import LiSnowNet
from derain.models.outdet import OutDet
from derain.scan import Scan

from .conftest import assert_same
from .two_processes import GRID, NETWORKS

SNOW = 110
LOADING = Loading(batch_size=2)


@pytest.fixture(params=NETWORKS)
def network(request) -> Callable[[], DerainingModule]:
    """Makes a network, the same one every time."""

    def make() -> DerainingModule:
        lightning.seed_everything(0)
        return NETWORKS[request.param]()

    return make


@pytest.fixture
def files(tmp_path) -> Folder:
    write_scenes(tmp_path, *4 * [300], name="{}.bin", rain=SNOW)
    parts = {"train": ["[012].bin"], "validation": ["3.bin"], "test": ["[23].bin"]}
    return Folder(str(tmp_path), "wads", **parts, loading=LOADING)


@pytest.fixture
def memory(files) -> InMemory:
    """What the files hold."""
    parts = ("train", "validation", "test")
    scans = ([files.reader.read(frame) for frame in files.frames(part)] for part in parts)
    return InMemory(*scans, card="wads", loading=LOADING)


def test_files_memory_and_plain_loaders_train_the_same_network(
    make_trainer, files, memory, network
) -> None:
    of_files, of_memory, of_loaders = network(), network(), network()
    expected = make_trainer(epochs=2)
    expected.fit(of_files, files)

    in_memory = make_trainer(epochs=2)
    in_memory.fit(of_memory, memory)
    assert_same(of_memory.state_dict(), of_files.state_dict())
    assert_same(in_memory.callback_metrics, expected.callback_metrics)

    by_loaders = make_trainer(epochs=2)
    task = agree_on_task(of_loaders, memory)
    training = scan_loader(memory.source("train"), "train", task, LOADING)
    validation = scan_loader(memory.source("validation"), "validation", task, LOADING)
    by_loaders.fit(of_loaders, training, validation)
    assert_same(of_loaders.state_dict(), of_files.state_dict())
    assert_same(by_loaders.callback_metrics, expected.callback_metrics)
    assert of_loaders.spec == of_memory.spec


def test_files_memory_and_plain_loaders_are_measured_alike(
    make_trainer, files, memory, outdet, tmp_path
) -> None:
    model = outdet()
    scores, probabilities = [], []
    task = agree_on_task(model, memory, training=False)
    loaders = [
        scan_loader(memory.source("test"), part, task, LOADING) for part in ("test", "predict")
    ]
    for tested, predicted in ((files, files), (memory, memory), loaders):
        scores += make_trainer(1).test(model, tested, verbose=False)
        batches = make_trainer(1).predict(model, predicted)
        probabilities.append([one for batch in batches for one in batch])
    assert scores[0] == scores[1] == scores[2]
    assert len(probabilities[0]) == 2
    for found in probabilities[1:]:
        for one, other in zip(found, probabilities[0], strict=True):
            np.testing.assert_array_equal(one, other)


def test_batches_that_were_made_before_are_trained_on_too(make_trainer, memory, network) -> None:
    model = network()
    task = agree_on_task(model, memory)
    made = [
        list(scan_loader(memory.source(part), part, task, LOADING))
        for part in ("train", "validation")
    ]
    for batch in made[0]:  # nothing but tensors
        assert not batch.measured
    before = {name: value.clone() for name, value in model.state_dict().items()}
    trainer = make_trainer(epochs=1)
    trainer.fit(model, *(DataLoader(batches, batch_size=None) for batches in made))
    assert trainer.global_step == 2
    assert any(not torch.equal(before[name], t) for name, t in model.state_dict().items())
    assert trainer.callback_metrics["val/loss"].isfinite()


def test_a_model_without_its_data_module_names_what_it_lacks(make_trainer, memory) -> None:
    loader = scan_loader(memory.source("train"), "train", agree_on_task(OutDet(), memory))
    with pytest.raises(InputError, match=r"Call .*agree_on_task\(model, data\)"):
        make_trainer(epochs=1).fit(OutDet(), loader)


def without_rain(memory: InMemory, *parts: str) -> InMemory:
    """The same scans, those of some parts without rain, as by another data set's labels."""
    scans = {
        part: [frame.read().with_label(np.full(300, 40)) for frame in memory.source(part)]
        if part in parts
        else memory.source(part)
        for part in ("train", "validation", "test")
    }
    return InMemory(*scans.values(), card="wads", loading=LOADING)


@pytest.mark.parametrize(("card", "rain"), [("wads", "falling-snow"), ("semantickitti", "rain")])
def test_training_on_scans_without_rain_is_refused(make_trainer, memory, card, rain) -> None:
    sources = without_rain(memory, "train").sources
    with pytest.raises(InputError, match=f"(?i)no point of these scans is {rain} .*{card}"):
        make_trainer(1).fit(OutDet(), InMemory(sources["train"], sources["train"], card=card))


def test_measuring_on_scans_without_rain_is_warned_of_once(make_trainer, memory, capsys) -> None:
    data, model = without_rain(memory, "validation", "test"), OutDet()
    warning = "no point of these scans is falling-snow"
    make_trainer(epochs=2).fit(model, data)
    assert capsys.readouterr().err.count(warning) == 1
    for measure in ("validate", "test"):
        getattr(make_trainer(1), measure)(model, data, verbose=False)
        assert capsys.readouterr().err.count(warning) == 1
        getattr(make_trainer(1), measure)(model, memory, verbose=False)
        assert warning not in capsys.readouterr().err


def test_measuring_on_scans_of_the_training_is_warned_of(make_trainer, memory, capsys) -> None:
    model, trained_on = OutDet(), InMemory(*2 * [memory.source("train")], card="wads")
    make_trainer(1, callbacks=[ScanCheck()]).fit(model, trained_on)
    assert "was trained on" not in capsys.readouterr().err
    for data, times in ((trained_on, 1), (memory, 0)):
        make_trainer(1, callbacks=[ScanCheck()]).validate(model, data, verbose=False)
        assert capsys.readouterr().err.count("the model was trained on") == times


def test_callbacks_go_without_a_data_module(make_trainer, memory, capsys, tmp_path) -> None:
    model = OutDet()
    task = agree_on_task(model, memory)
    loaders = {
        part: scan_loader(memory.source(part), part, task) for part in ("train", "validation")
    }
    callbacks = [ScanCheck(), Panels(), TestReport()]
    make_trainer(1, callbacks=callbacks).fit(model, *loaders.values())
    test = scan_loader(memory.source("test"), "test", task)
    make_trainer(1, callbacks=callbacks, default_root_dir=tmp_path).test(model, test, verbose=False)
    assert "WADS, 2 scans" in capsys.readouterr().out


def test_a_run_of_loaders_goes_on_from_its_checkpoint(make_trainer, memory, tmp_path) -> None:
    def fit(epochs: int, checkpoint: Path | None = None, rows: int = 16) -> DerainingModule:
        lightning.seed_everything(0)
        model = LiSnowNet(grid={**GRID, "rows": rows}, width=2)
        loader = scan_loader(memory.source("train"), "train", agree_on_task(model, memory), LOADING)
        trainer = make_trainer(epochs=epochs)
        trainer.fit(model, loader, ckpt_path=checkpoint)
        trainer.save_checkpoint(tmp_path / f"{epochs}.ckpt")
        return model

    straight = fit(epochs=3)
    fit(epochs=1)
    assert_same(fit(3, tmp_path / "1.ckpt").state_dict(), straight.state_dict())
    with pytest.raises(InputError, match="view differs from that of the loader"):
        fit(3, tmp_path / "1.ckpt", rows=32)


def test_a_run_of_loaders_does_not_go_on_with_other_candidates(make_trainer, tmp_path) -> None:
    scans = [Scan.of(scene(300, seed)) for seed in range(3)]
    near = [scan.with_label(np.where(scan.range < 8, SNOW, 0)) for scan in scans]
    memory = InMemory(near, near, near, card="wads", loading=LOADING)

    def fit(candidates: float | None, checkpoint: Path | None = None) -> OutDet:
        model = OutDet(neighbours=5, candidates=candidates)
        loader = scan_loader(memory.source("train"), "train", agree_on_task(model, memory), LOADING)
        trainer = make_trainer(epochs=1 if checkpoint is None else 2)
        trainer.fit(model, loader, ckpt_path=checkpoint)
        trainer.save_checkpoint(tmp_path / "1.ckpt")
        return model

    assert fit(None).spec.candidates is None
    with pytest.raises(InputError, match="view differs from that of the loader"):
        fit(0.9, tmp_path / "1.ckpt")
    assert fit(0.9).spec.candidates is not None
    with pytest.raises(InputError, match="view differs from that of the loader"):
        fit(None, tmp_path / "1.ckpt")
    assert fit(0.9, tmp_path / "1.ckpt").trainer.current_epoch == 2
