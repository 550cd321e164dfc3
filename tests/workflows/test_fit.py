"""A network is trained by a function, as by the command."""

import shlex
from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_wads

from derain.errors import InputError
from derain.models.checkpoint import load_model
from derain.workflows.fit import FitResults, fit, fit_options


def test_settings_are_options_of_the_command() -> None:
    settings = {"data.root": Path("my data"), "trainer.max_epochs": 2, "data.make": False}
    words = shlex.join(fit_options("a.yaml", {**settings, "start": None, "model.channels": ["x"]}))
    assert words == (
        "--config a.yaml --data.root 'my data' --trainer.max_epochs 2 --data.make false "
        "--start null --model.channels '[\"x\"]'"
    )


@pytest.mark.parametrize(
    ("value", "text"),
    [(np.int64(2), "2"), (np.array([1, 2]), "[1, 2]"), ([Path("a.bin")], '["a.bin"]')],
)
def test_settings_may_be_of_numpy_and_lists_of_paths(value, text) -> None:
    assert fit_options(None, {"data.train": value}) == ["--data.train", text]


def test_a_setting_that_no_option_can_have_is_refused_by_its_type() -> None:
    with pytest.raises(InputError, match="settings: one cannot be of type set"):
        fit_options(None, {"data.train": {"a.bin"}})


@pytest.fixture
def settings(tmp_path, one_block) -> dict[str, object]:
    """Settings for one epoch of a data set in the layout of WADS, of two sequences."""
    return {
        "data.root": write_wads(tmp_path / "WADS", "00", "01"),
        "data.split": {"train": ["00"], "validation": ["01"], "test": []},
        "data.loading.workers": 0,
        "trainer.max_epochs": 1,
        "trainer.logger.save_dir": tmp_path / "runs",
        "panels.scans": 0,
    }


def test_a_training_returns_its_best_checkpoint_and_score(settings, tmp_path, capsys) -> None:
    results = fit("outdet_wads.yaml", settings, quiet=True)
    assert load_model(results.checkpoint).spec.network == "outdet"
    assert results.folder == tmp_path / "runs/outdet_wads/version_0"
    assert results.iou == pytest.approx(results.metrics["val/iou"])
    assert capsys.readouterr().out == ""
    with pytest.raises(InputError, match=r"data\.rot: no such option"):
        fit("outdet_wads.yaml", {"data.rot": "WADS"})


@pytest.mark.parametrize(
    ("option", "name"), [("trainer.limit_val_batches", "last.ckpt"), ("trainer.max_epochs", None)]
)
def test_without_a_validation_the_checkpoint_is_the_last_if_there_is_any(
    settings, option, name
) -> None:
    checkpoint = fit("outdet_wads.yaml", {**settings, option: 0}, quiet=True).checkpoint
    assert (checkpoint and checkpoint.name) == name


def test_without_a_logger_a_training_has_no_folder(settings, here) -> None:
    del settings["trainer.logger.save_dir"]
    results = fit("outdet_wads.yaml", {**settings, "trainer.logger": False}, quiet=True)
    assert results.folder is None
    assert load_model(results.checkpoint).spec.network == "outdet"
    assert {path.name for path in here.iterdir()} == {"WADS", "checkpoints"}


def test_without_rain_to_validate_on_there_is_no_iou() -> None:
    assert FitResults(Path("best.ckpt"), None, {"val_iou": np.nan}).iou is None
