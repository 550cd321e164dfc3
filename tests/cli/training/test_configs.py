"""Every packaged configuration can be used; one of each network is trained and deployed."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from derain.annotation.teach import teach
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.filters import DROR, FilterDerainer
from derain.models.checkpoint import load_model
from derain.sources.folders import named_frames
from derain.workflows.configurations import packaged_configs
from derain.workflows.training import DerainCLI

WriteScan = Callable[..., None]


# A step of training and one of validation.
ONE_STEP = [
    *("--trainer.max_epochs", "1", "--trainer.limit_train_batches", "1"),
    *("--trainer.enable_progress_bar", "false", "--panels.scans", "0"),
]
# Trained below, or in tests of their own.
TRAINED = {
    *("lisnownet_rehearse3d.yaml", "outdet_wads36.yaml", "outdet_wads.yaml"),
    *("salsanext_lite_taught.yaml", "outdet_mixture.yaml", "cues_worlds.yaml"),
}

NARROW = ["--model.width", "4"]
SMALL_GRID = ["--model.grid", "{rows: 18, columns: 60, inclination: [-30, 20]}"]


def sequence_36(root: Path, write_labelled: WriteScan) -> tuple[list[str], Path]:
    """The scans of WADS's sequence 36 that the patterns of the configuration name."""
    folder = root / "sequences/36"
    for frame in ("042220", "042231", "042233", "042235", "042237", "042239", "042241"):
        write_labelled(folder / f"velodyne/{frame}.bin", folder / f"labels/{frame}.label", 110)
    write_labelled(root / "sample.bin", root / "sample.label", 110)
    return [], root


def taught_scenes(root: Path, write_labelled: WriteScan) -> tuple[list[str], Path]:
    """Three scenes that a filter has taught; the last is held out."""
    drive = root.with_name("drive")
    for number in range(3):
        write_labelled(drive / f"velodyne/{number}.bin", drive / f"labels/{number}.label", 1)
    teach(FilterDerainer(DROR()), named_frames([drive / "velodyne"]), root)
    held_out = root.with_name("held_out")
    held_out.mkdir()
    (held_out / "2.bin").symlink_to((drive / "velodyne/2.bin").absolute())
    return NARROW + SMALL_GRID, held_out


@pytest.mark.parametrize("config", sorted(packaged_configs().keys() - TRAINED))
def test_model_data_and_trainer_are_those_that_a_packaged_configuration_names(
    succeed, monkeypatch, write_labelled, config
) -> None:
    made: list[DerainCLI] = []

    def leave(cli: DerainCLI) -> None:
        made.append(cli)
        raise SystemExit(0)

    monkeypatch.setattr(DerainCLI, "before_fit", leave, raising=False)
    if config.endswith("taught.yaml"):  # its data module reads what is taught at once
        taught_scenes(Path("data"), write_labelled)
    succeed("fit", "--config", config, "--data.root", "data")
    (cli,) = made
    written = yaml.safe_load(packaged_configs()[config].read_text())
    assert f"{cli.trainer.logger.name}.yaml" == config
    assert cli.trainer.max_epochs == written["trainer"]["max_epochs"]
    for name, part in (("model", cli.model), ("data", cli.datamodule)):
        package, _, own_name = written[name]["class_path"].rpartition(".")
        assert type(part).__name__ == own_name
        assert type(part).__module__.startswith(package)


@pytest.mark.usefixtures("one_block", "two_sizes", "short_proof")
@pytest.mark.parametrize(
    ("config", "prepare"),
    [
        ("outdet_wads36.yaml", sequence_36),
        ("salsanext_lite_taught.yaml", taught_scenes),
    ],
)
def test_a_packaged_configuration_is_trained_measured_and_deployed(
    succeed, monkeypatch, write_labelled, config, prepare
) -> None:
    options, test_folder = prepare(Path("data"), write_labelled)
    data = ["--config", config, "--data.root", "data", *options, *ONE_STEP]
    run = Path("runs") / config.removesuffix(".yaml") / "version_0"

    succeed("fit", *data)
    checkpoint = run / "checkpoints/last.ckpt"
    assert {path.name for path in checkpoint.parent.iterdir()} == {"best.ckpt", "last.ckpt"}
    assert list(run.glob("events.out.tfevents.*"))
    stored = yaml.safe_load((run / "config.yaml").read_text())
    assert stored["data"]["init_args"]["root"] == "data"

    outcome = succeed("test", *data, "--ckpt_path", checkpoint)
    assert "pooled over points" in outcome.out
    report = json.loads((run / "test.json").read_text())
    scans = sorted(test_folder.glob("*.bin"))
    assert report["scans"] == len(scans) > 0
    assert all(score is None or 0 <= score <= 1 for score in report["scores"].values())

    # As the deployed model computes, whatever the training did.
    succeed("predict", *data, "--trainer.precision", "32", "--ckpt_path", checkpoint)
    timed_on = ["--scan", scans[0], "--repeats", "1"]
    succeed("export", checkpoint, "--out", "model.onnx", *timed_on)
    derainer = Derainer("model.onnx")
    for scan in scans:
        label = np.fromfile(Path("predictions") / f"{scan.stem}.label", "<u4")
        np.testing.assert_array_equal(label, derainer(read_scan(scan)))


@pytest.mark.usefixtures("two_sizes")
def test_lisnownet_is_trained_without_a_label_in_the_whole_data_set(
    succeed, last_line, write_labelled
) -> None:
    for sequence in ("00", "01", "02"):
        folder = Path("data/sequences") / sequence
        scan = folder / f"lidar_radar_pcd/{sequence}0000.bin"
        write_labelled(scan, folder / "none.label", rain=3)
    split = '{train: ["00"], validation: ["01"], test: ["02"]}'
    data = ["--config", "lisnownet_rehearse3d.yaml", "--data.root", "data", "--data.split", split]
    data += ["--data.loading.workers", "0", *NARROW, *SMALL_GRID, *ONE_STEP]
    succeed("fit", *data)
    best = Path("runs/lisnownet_rehearse3d/version_0/checkpoints/best.ckpt")
    assert load_model(best).spec.data == "REHEARSE-3D"
    # It cannot be measured, but it can be used.
    line = last_line("test", *data, "--ckpt_path", best)
    assert "020000.bin: its labels are not at" in line
    succeed("predict", *data, "--ckpt_path", best)
    assert len(list(Path("predictions").glob("*.label"))) == 1
