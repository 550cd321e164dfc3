"""``derain fit|validate|test|predict``: Lightning's command line, and what it cannot use."""

import json
import shlex
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import torch
import yaml
from tensorboard.backend.event_processing.event_accumulator import EventAccumulator

from derain.errors import InputError
from derain.models.checkpoint import load_model
from derain.workflows.configurations import packaged_configs, with_packaged_configs


@pytest.fixture(autouse=True)
def _in_a_folder_of_its_own(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)


@pytest.mark.parametrize("written", [["--config", "{}"], ["-c", "{}"], ["--config={}"]])
def test_a_packaged_configuration_is_found_by_name(written: list[str]) -> None:
    packaged = packaged_configs()["outdet_wads.yaml"]
    assert packaged.is_file()
    arguments = ["fit", *(part.format("outdet_wads.yaml") for part in written), "--data.root", "x"]
    expected = ["fit", *(part.format(packaged) for part in written), "--data.root", "x"]
    assert with_packaged_configs(arguments) == expected


def test_a_file_of_the_name_of_a_packaged_configuration_goes_first() -> None:
    Path("outdet_wads.yaml").touch()
    arguments = ["fit", "--config", "outdet_wads.yaml"]
    assert with_packaged_configs(arguments) == arguments


def test_an_unknown_configuration_is_one_line_with_the_known_ones(refused) -> None:
    line = refused("fit", "--config", "outdet_mars.yaml", "--data.root", "MARS")
    assert line.startswith("derain: outdet_mars.yaml: no such configuration. Packaged are ")
    assert all(name in line for name in packaged_configs())
    with pytest.raises(InputError, match="no such configuration"):
        with_packaged_configs(["fit", "--config=outdet_mars.yaml"])


@pytest.fixture
def bad_checkpoints(checkpoint: Path) -> None:
    content = torch.load(checkpoint, weights_only=True)
    parameters = content["hyper_parameters"]
    spec = {**parameters["spec"], "network": "resnet"}
    torch.save({**content, "hyper_parameters": {**parameters, "spec": spec}}, "resnet.ckpt")
    torch.save(content["state_dict"], "weights.ckpt")
    Path("cut.ckpt").write_bytes(checkpoint.read_bytes()[:1000])


@pytest.mark.usefixtures("bad_checkpoints")
@pytest.mark.parametrize(
    ("command", "path", "reason"),
    [
        ("fit", "https://example.org/outdet.ckpt", "is an address. Download it and give the file."),
        ("test", "s3://bucket/outdet.ckpt", "is an address. Download it and give the file."),
        ("fit", "none.ckpt", "no such file"),
        ("fit", "cut.ckpt", "damaged"),
        ("test", "weights.ckpt", "not a checkpoint of derain"),
        ("test", "resnet.ckpt", "a checkpoint of 'resnet'"),
    ],
)
def test_a_checkpoint_that_cannot_be_used_is_one_line(
    refused, wads: list[str], command: str, path: str, reason: str
) -> None:
    line = refused(command, *wads, "--ckpt_path", path)
    assert line.startswith(f"derain: {path}: ")
    assert reason in line
    assert not Path("runs").exists()


def test_a_checkpoint_chooses_no_module_to_import(
    succeed, wads: list[str], checkpoint: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    Path("foreign.py").write_text("raise RuntimeError('imported')")
    monkeypatch.syspath_prepend(str(Path.cwd()))
    content = torch.load(checkpoint, weights_only=True)
    content["hyper_parameters"]["_class_path"] = "foreign.Network"
    torch.save(content, "foreign.ckpt")
    succeed("validate", *wads, "--ckpt_path", "foreign.ckpt")
    written = yaml.safe_load(Path("runs/outdet_wads/version_0/config.yaml").read_text())
    assert written["model"]["class_path"] == "derain.models.outdet.module.OutDet"


def test_a_training_that_diverges_is_one_line_and_leaves_no_checkpoint_of_it(
    run_derain, wads: list[str]
) -> None:
    too_fast = ["--trainer.max_epochs", "3", "--model.learning_rate", "1e30"]
    outcome = run_derain("fit", *wads, *too_fast)
    assert outcome.code == 2
    line = outcome.err.splitlines()[-1]
    assert line.startswith("derain: ")
    assert "not finite" in line
    assert "learning" in line
    for path in Path("runs").rglob("*.ckpt"):
        load_model(path)


def test_no_training_goes_on_from_weights_alone(refused, wads: list[str], checkpoint: Path) -> None:
    line = refused("fit", *wads, "--ckpt_path", checkpoint)
    reason = "holds weights alone, no state of a training to go on from"
    assert line.startswith(f"derain: {checkpoint}: {reason}. Go on from the last.ckpt of a run")
    assert not Path("runs").exists()


@pytest.mark.parametrize("command", ["test", "predict"])
def test_a_model_without_training_is_not_measured(
    run_derain, wads: list[str], command: str
) -> None:
    outcome = run_derain(command, *wads)
    assert outcome.code == 2
    assert "Give a checkpoint: --ckpt_path." in outcome.err.splitlines()[-1]


SPOILS: dict[str, tuple[Callable[[Path], None], str]] = {
    "unknown ids": (
        lambda path: np.full(300, 77, "<u4").tofile(path),
        "ids [77] are no classes of WADS. Name them in the data card.",
    ),
    "another length": (
        lambda path: np.zeros(299, "<u4").tofile(path),
        "holds 299 labels of 4 bytes for a scan of 300 points. Give the label file that belongs",
    ),
    "missing": (lambda path: path.unlink(), "its labels are not at"),
}


@pytest.mark.parametrize(
    ("spoil", "workers"), [("unknown ids", "0"), ("another length", "0"), ("missing", "1")]
)
def test_labels_that_cannot_be_used_are_named_with_the_remedy(
    run_derain, wads: list[str], checkpoint: Path, tmp_path: Path, spoil: str, workers: str
) -> None:
    change, reason = SPOILS[spoil]
    label = tmp_path / "WADS/sequences/02/labels/0.label"
    change(label)
    options = ["--ckpt_path", checkpoint, "--data.loading.workers", workers]
    outcome = run_derain("test", *wads, *options)
    assert outcome.code == 2
    assert "Traceback" not in outcome.err
    line = outcome.err.splitlines()[-1]
    assert line.startswith("derain: ")
    assert str(label) in line
    assert reason in line


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["outdet_wads.yaml", "--data.root", "none"], "no such folder, though the split names"),
        (["outdet_simulated.yaml", "--data.campaign.scans", "0"], "scans: 0 is too few. Give 1"),
    ],
)
def test_data_that_cannot_be_used_is_named_with_the_remedy(
    run_derain, options: list[str], reason: str
) -> None:
    quiet = ["--trainer.enable_progress_bar", "false", "--data.loading.workers", "0"]
    outcome = run_derain("fit", "--config", *options, *quiet)
    assert outcome.code == 2
    assert "Traceback" not in outcome.err
    assert outcome.err.splitlines()[-1].startswith("derain: ")
    assert reason in outcome.err.splitlines()[-1]


def test_predictions_need_no_labels(
    run_derain, wads: list[str], checkpoint: Path, tmp_path: Path
) -> None:
    for label in tmp_path.rglob("*.label"):
        label.unlink()
    options = ["--ckpt_path", checkpoint, "--predictions.folder", "found"]
    assert run_derain("predict", *wads, *options).code == 0
    assert np.fromfile("found/0.label", "<u4").shape == (300,)


def test_intensities_of_another_unit_are_warned_of_and_scaled(
    run_derain, wads: list[str], checkpoint: Path, tmp_path: Path
) -> None:
    predict = ["predict", *wads, "--ckpt_path", checkpoint, "--predictions.folder"]
    assert not scan_warnings(run_derain(*predict, "whole"))
    for scan in tmp_path.rglob("*.bin"):
        points = np.fromfile(scan, np.float32).reshape(-1, 4)
        (points / np.array([1, 1, 1, 256], np.float32)).tofile(scan)
    (warning,) = scan_warnings(run_derain(*predict, "small"))
    scan = tmp_path / "WADS/sequences/02/velodyne/0.bin"
    assert warning.startswith(f"derain: warning: {scan}: mean intensity 0.")
    assert "see --data.loading.intensity_scale" in warning
    scaled = ["--data.loading.intensity_scale", "256"]
    assert not scan_warnings(run_derain(*predict, "scaled", *scaled))
    whole, small, again = (
        np.fromfile(f"{folder}/0.label", "<u4") for folder in ("whole", "small", "scaled")
    )
    np.testing.assert_array_equal(again, whole)
    assert (small != whole).any()
    (warning,) = scan_warnings(run_derain("fit", *wads, "--trainer.fast_dev_run", "true"))
    assert "sequences/00/velodyne/0.bin: mean intensity 0." in warning


def scan_warnings(outcome: Any) -> list[str]:
    """What was said of scans before the first batch."""
    assert outcome.code == 0, outcome.err
    return [line for line in outcome.err.splitlines() if line.startswith("derain: warning: ")]


def test_predictions_that_cannot_be_written_are_reported(
    run_derain, wads: list[str], checkpoint: Path
) -> None:
    Path("file").touch()
    options = ["--ckpt_path", checkpoint, "--predictions.folder", "file/below"]
    outcome = run_derain("predict", *wads, *options)
    assert outcome.code == 2
    assert "file/below/0.label: cannot be written" in outcome.err.splitlines()[-1]


def test_training_goes_on_from_a_checkpoint_and_keeps_what_was_best_before(
    succeed, wads: list[str]
) -> None:
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


def test_a_data_set_of_any_layout_is_trained_on_with_a_card_alone(
    run_derain, write_labelled: Callable[..., None]
) -> None:
    for name in ("monday", "tuesday"):
        folder = Path("drives/recordings") / name
        write_labelled(folder / "ouster/0.bin", folder / "truth/0.label", rain=7)
    Path("card.yaml").write_text(
        "name: drives\nclasses: {0: other, 7: spray}\nrain: [7]\n"
        "layout: {sequences: recordings, scans: ouster, labels: truth}\n"
        "split: {train: [monday], validation: [tuesday], test: [tuesday]}\n"
    )
    options = [
        *("--model", "OutDet", "--data", "Sequences"),
        *("--data.root", "drives", "--data.card", "card.yaml"),
        *("--trainer.max_epochs", "1", "--trainer.enable_progress_bar", "false"),
        *("--panels.scans", "0", "--errors.pictures", "0"),
    ]
    assert run_derain("fit", *options).code == 0
    (last,) = Path().rglob("last.ckpt")
    spec = load_model(last).spec
    assert (spec.data, spec.rain, spec.training) == ("drives", (7,), {"sequences": ("monday",)})
    assert run_derain("predict", *options, "--ckpt_path", last).code == 0
    assert [path.name for path in Path("predictions").iterdir()] == ["0.label"]


SCALARS = {"test/iou", "test/f1", "test/precision", "test/recall", "test/average_precision"}


def test_a_test_is_logged_into_the_folder_of_its_training_or_where_it_is_told_to(
    run_derain, succeed, wads: list[str], checkpoint: Path, caplog: pytest.LogCaptureFixture
) -> None:
    with caplog.at_level("INFO", "lightning.pytorch.utilities.rank_zero"):
        trained = run_derain("fit", *wads, "--trainer.max_epochs", "2")
    assert trained.code == 0
    run = Path("runs/outdet_wads/version_0")
    best = run / "checkpoints/best.ckpt"
    kept = {path: path.read_bytes() for path in run.rglob("*") if path.is_file()}
    elsewhere = ["--trainer.logger.save_dir", "tests"]
    assert run_derain("test", *wads, *elsewhere, "--ckpt_path", best).code == 0
    assert Path("tests/outdet_wads/version_0/test.json").is_file()
    assert not (run / "test.json").exists()
    outcome = succeed("test", *wads, "--errors.pictures", "1", "--ckpt_path", best)
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

    # A checkpoint that lies in no run has a folder of its own for its test, which trains nothing.
    assert run_derain("test", *wads, "--ckpt_path", checkpoint).code == 0
    assert Path("runs/outdet_wads/version_1/test.json").is_file()
    assert not Path("runs/outdet_wads/version_1/checkpoints").exists()

    # Nothing but derain reports on a run.
    printed = trained.out + trained.err + outcome.out + outcome.err
    assert "Trainable params" not in printed
    assert "DataLoader 0" not in printed
    assert outcome.out.count("pooled over points") == 1
    assert "max_epochs=2" in caplog.text  # what Lightning reports of itself does come through
    assert "Tip" not in caplog.text
