"""``derain fit|validate|test|predict``: Lightning's command line, and what it cannot use."""

import json
import shlex
from pathlib import Path

import numpy as np
import pytest
import torch
import yaml
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from derain.models.checkpoint import load_model
from derain.workflows.configurations import packaged_configs, with_packaged_configs


@pytest.mark.parametrize("written", [["--config", "{}"], ["-c", "{}"], ["--config={}"]])
def test_a_packaged_configuration_is_found_by_name(written) -> None:
    packaged = packaged_configs()["outdet_wads.yaml"]
    assert packaged.is_file()
    arguments = ["fit", *(part.format("outdet_wads.yaml") for part in written), "--data.root", "x"]
    expected = ["fit", *(part.format(packaged) for part in written), "--data.root", "x"]
    assert with_packaged_configs(arguments) == expected


def test_a_file_of_the_name_of_a_packaged_configuration_goes_first() -> None:
    Path("outdet_wads.yaml").write_text("seed_everything: 1")
    arguments = ["fit", "--config", "outdet_wads.yaml"]
    assert with_packaged_configs(arguments) == arguments


def test_an_unknown_configuration_is_one_line_with_the_known_ones(refused) -> None:
    line = refused("fit", "--config=outdet_mars.yaml", "--data.root", "MARS")
    assert line.startswith("derain: outdet_mars.yaml: no such configuration. Packaged are ")
    assert all(name in line for name in packaged_configs())


@pytest.mark.parametrize(
    ("command", "path", "reason"),
    [
        ("fit", "https://example.org/outdet.ckpt", "is an address. Download it and give the file."),
        ("fit", "none.ckpt", "no such file"),
        ("fit", "cut.ckpt", "damaged"),
        ("test", "weights.ckpt", "not a checkpoint of derain"),
    ],
)
def test_a_checkpoint_that_cannot_be_used_is_one_line(
    refused, wads, checkpoint, command, path, reason
) -> None:
    torch.save(torch.load(checkpoint, weights_only=True)["state_dict"], "weights.ckpt")
    Path("cut.ckpt").write_bytes(checkpoint.read_bytes()[:1000])
    line = refused(command, *wads, "--ckpt_path", path)
    assert line.startswith(f"derain: {path}: ")
    assert reason in line
    assert not Path("runs").exists()


def test_a_checkpoint_chooses_no_module_to_import(succeed, wads, checkpoint, monkeypatch) -> None:
    Path("foreign.py").write_text("raise RuntimeError('imported')")
    monkeypatch.syspath_prepend(str(Path.cwd()))
    content = torch.load(checkpoint, weights_only=True)
    content["hyper_parameters"]["_class_path"] = "foreign.Network"
    torch.save(content, "foreign.ckpt")
    succeed("validate", *wads, "--ckpt_path", "foreign.ckpt")
    written = yaml.safe_load(Path("runs/outdet_wads/version_0/config.yaml").read_text())
    assert written["model"]["class_path"] == "derain.models.outdet.module.OutDet"


def test_a_training_that_diverges_is_one_line_and_leaves_no_checkpoint_of_it(
    last_line, wads
) -> None:
    too_fast = ["--trainer.max_epochs", "3", "--model.learning_rate", "1e30"]
    line = last_line("fit", *wads, *too_fast)
    assert "not finite" in line
    assert "learning" in line
    for path in Path("runs").rglob("*.ckpt"):
        load_model(path)


def test_no_training_goes_on_from_another_network(succeed, refused, wads) -> None:
    succeed("fit", *wads, "--trainer.max_epochs", "1")
    last = "runs/outdet_wads/version_0/checkpoints/last.ckpt"
    line = refused("fit", *wads, "--config", "salsanext_wads.yaml", "--ckpt_path", last)
    assert last in line
    assert "OutDet" in line
    assert "SalsaNext" in line


def test_no_training_goes_on_from_weights_alone(refused, wads, checkpoint) -> None:
    line = refused("fit", *wads, "--ckpt_path", checkpoint)
    reason = "holds weights alone, without the state of a training to resume"
    assert line.startswith(f"derain: {checkpoint}: {reason}. Resume from the last.ckpt of a run")
    assert not Path("runs").exists()


def test_intensities_of_another_unit_are_warned_of_and_scaled(
    succeed, wads, checkpoint, tmp_path
) -> None:
    predict = ["predict", *wads, "--ckpt_path", checkpoint, "--predictions.folder"]
    assert "derain: warning: " not in succeed(*predict, "whole").err
    scan = tmp_path / "WADS/sequences/02/velodyne/0.bin"
    points = np.fromfile(scan, np.float32).reshape(-1, 4)
    (points / np.array([1, 1, 1, 256], np.float32)).tofile(scan)
    warned = succeed(*predict, "small").err
    assert f"derain: warning: {scan}: mean intensity 0." in warned
    assert "see --data.loading.intensity_scale" in warned
    scaled = succeed(*predict, "scaled", "--data.loading.intensity_scale", "256")
    assert "derain: warning: " not in scaled.err
    assert Path("scaled/0.label").read_bytes() == Path("whole/0.label").read_bytes()


def test_training_goes_on_from_a_checkpoint_and_keeps_what_was_best_before(succeed, wads) -> None:
    first, second = (Path(f"runs/outdet_wads/version_{n}/checkpoints") for n in (0, 1))
    # The earlier the better, as where a training goes wrong.
    earliest = ["--checkpoint.monitor", "epoch", "--checkpoint.mode", "min"]
    fit = ["fit", *wads, *earliest, "--trainer.max_epochs"]
    trained = succeed(*fit, "1")
    export = ["derain", "export", str(first / "best.ckpt"), "--out", "model.onnx"]
    assert shlex.split(trained.out.splitlines()[-1]) == export
    outcome = succeed(*fit, "2", "--ckpt_path", first / "last.ckpt")
    assert "derain: warning" not in outcome.err
    before, after = (torch.load(run / "last.ckpt", weights_only=True) for run in (first, second))
    assert (before["epoch"], after["epoch"]) == (0, 1)
    assert (before["global_step"], after["global_step"]) == (1, 2)
    assert (second / "best.ckpt").read_bytes() == (first / "best.ckpt").read_bytes()
    assert load_model(second / "last.ckpt").spec.data == "WADS"


SCALARS = {"test/iou", "test/f1", "test/precision", "test/recall", "test/average_precision"}


def test_a_test_is_logged_into_the_folder_of_its_training(succeed, wads, caplog) -> None:
    with caplog.at_level("INFO", "lightning.pytorch.utilities.rank_zero"):
        trained = succeed("fit", *wads, "--trainer.max_epochs", "2")
    run = Path("runs/outdet_wads/version_0")
    best = run / "checkpoints/best.ckpt"
    kept = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    outcome = succeed("test", *wads, "--panels.scans", "1", "--ckpt_path", best)
    assert [path.name for path in run.parent.iterdir()] == ["version_0"]
    assert all(path.read_bytes() == content for path, content in kept.items())
    assert f"Written to {run.resolve()}/test.json" in outcome.out
    assert yaml.safe_load((run / "test.yaml").read_text())["ckpt_path"] == str(best)
    report = json.loads((run / "test.json").read_text())
    assert (report["data"], report["checkpoint"]) == ("WADS", str(best))

    events = EventAccumulator(str(run)).Reload()
    assert set(events.Tags()["scalars"]) >= SCALARS | {"val/iou", "hp_metric"}
    (iou,) = events.Scalars("test/iou")
    assert iou.value == pytest.approx(report["scores"]["iou"])
    assert iou.step == torch.load(best, weights_only=True)["global_step"]
    assert set(events.Tags()["images"]) == {"test: errors by class and range", "test: threshold"}
    assert "test/text_summary" in events.Tags()["tensors"]

    # Nothing but derain reports on a run.
    printed = trained.out + trained.err + outcome.out + outcome.err
    assert "Trainable params" not in printed
    assert "DataLoader 0" not in printed
    assert outcome.out.count("pooled over points") == 1
    assert "max_epochs=2" in caplog.text  # what Lightning reports of itself does come through
    assert "Tip" not in caplog.text


def test_a_test_is_logged_where_an_option_names_or_into_a_folder_of_its_own(
    succeed, wads, checkpoint
) -> None:
    of_a_run = Path("runs/mine/version_7/checkpoints/best.ckpt")
    of_a_run.parent.mkdir(parents=True)
    of_a_run.write_bytes(checkpoint.read_bytes())
    (of_a_run.parent.parent / "config.yaml").touch()
    succeed("test", *wads, "--trainer.logger.save_dir", "tests", "--ckpt_path", of_a_run)
    assert [path.parent for path in Path().rglob("test.json")] == [
        Path("tests/outdet_wads/version_0")
    ]
    # A checkpoint that lies in no run trains nothing either.
    succeed("test", *wads, "--ckpt_path", checkpoint)
    own = Path("runs/outdet_wads/version_0")
    assert (own / "test.json").is_file()
    assert not (own / "checkpoints").exists()
