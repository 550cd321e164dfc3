"""A network in one file outside derain does all that derain's own networks do."""

import sys
from collections.abc import Iterator
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import pytest
from recorded_scenes import write_wads

from derain.cli.main import main
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export.proof import THREADS
from derain.export.runtime import Derainer
from derain.models.checkpoint import load_model
from derain.models.registry import NETWORKS

EXAMPLES = Path(__file__).resolve().parents[2] / "examples"

DROPS = np.arange(300) >= 270


@pytest.fixture(scope="module")
def toy_network() -> Iterator[ModuleType]:
    """The example's module; derain knows its network as long as these tests run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(NETWORKS, "_members", dict(NETWORKS))
        patch.syspath_prepend(EXAMPLES)
        yield import_module("toy_network")
        del sys.modules["toy_network"]


@pytest.fixture(scope="module")
def root(tmp_path_factory) -> Path:
    """Four made-up scans in the layout of WADS: two to train on, one to validate, one to test."""
    return write_wads(tmp_path_factory.mktemp("WADS"), "00", "01", "02", "03")


@pytest.fixture(scope="module")
def data(root) -> list[str]:
    """Options that name those scans, and the network by its class."""
    split = '{train: ["00", "01"], validation: ["02"], test: ["03"]}'
    return [
        *("--model", "toy_network.Toy", "--data", "Wads", "--data.root", str(root)),
        *("--data.split", split, "--trainer.enable_progress_bar", "false"),
        *("--trainer.logger.class_path", "TensorBoardLogger"),
        *("--trainer.logger.save_dir", f"{root}/runs", "--trainer.accelerator", "cpu"),
        *("--panels.scans", "0"),
    ]


@pytest.fixture(scope="module")
def checkpoint(toy_network, root, data) -> Path:
    """What ``derain fit`` makes of it."""
    assert main(["fit", *data, "--trainer.max_epochs", "8"]) == 0
    (best,) = root.glob("runs/**/best.ckpt")
    return best


@pytest.fixture(scope="module")
def model(checkpoint, root) -> Path:
    """What ``derain export`` makes of that."""
    out = root / "toy.onnx"
    assert main(["export", str(checkpoint), "--out", str(out), "--repeats", "1"]) == 0
    return out


def test_it_learns_and_is_tested(run_derain, checkpoint, data) -> None:
    outcome = run_derain("test", *data, "--ckpt_path", checkpoint)
    assert outcome.code == 0, outcome.err
    loaded = load_model(checkpoint)
    assert (loaded.NAME, loaded.spec.network) == ("toy", "toy")
    assert loaded.spec.view == {"kind": "neighbours", "neighbours": 5}
    assert loaded.spec.channels == ("z", "intensity")


def test_it_is_exported_with_the_proof_of_every_hard_case(model) -> None:
    cases = Derainer(model).metadata["proof"]["cases"]
    assert [case["name"] for case in cases] == [name for name, _ in hard_cases() for _ in THREADS]
    assert all(case["finite"] for case in cases)


def test_what_it_learnt_is_rain_in_scans_it_never_saw(run_derain, model, tmp_path) -> None:
    scan = tmp_path / "scan.bin"
    scene(300, seed=9).tofile(scan)
    outcome = run_derain("run", model, scan, "--out", tmp_path / "out")
    assert outcome.code == 0, outcome.err
    rain = np.fromfile(tmp_path / "out/scan.label", "<u4") == 1
    assert (rain & DROPS).sum() / (rain | DROPS).sum() > 0.8


def test_without_the_package_that_brings_it_its_checkpoint_is_refused(
    run_derain, checkpoint, monkeypatch
) -> None:
    known = {name: network for name, network in NETWORKS.items() if name != "toy"}
    monkeypatch.setattr(NETWORKS, "_members", known)
    outcome = run_derain("info", checkpoint)
    assert (outcome.code, outcome.out) == (2, "")
    assert outcome.err.startswith(f"derain: {checkpoint}: a checkpoint of 'toy', a network that no")
    assert "entry points `derain.networks`" in outcome.err
