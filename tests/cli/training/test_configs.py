"""Every packaged configuration trains on small made-up data; one a network is deployed."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import yaml

from derain.annotation.teach import teach
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.filters import DROR, FilterDerainer
from derain.models.checkpoint import load_model
from derain.scan import Scan
from derain.sources.folders import named_frames
from derain.system.open3d_import import import_open3d
from derain.workflows.configurations import packaged_configs

WriteScan = Callable[..., None]

# Fills a folder with a data set; returns the options it needs and its folder of test scans.
Prepare = Callable[[Path, WriteScan], tuple[list[str], Path]]

QUICK = [
    *("--trainer.enable_progress_bar", "false"),
    *("--panels.scans", "0", "--errors.pictures", "0"),
]
# A step of training and one of validation.
ONE_STEP = ["--trainer.max_epochs", "1", "--trainer.limit_train_batches", "1"]
SPLIT = '{train: ["00", "01"], validation: ["02"], test: ["03"]}'


def in_sequences(scans: str, labels: str, rain: int) -> Prepare:
    """Four sequences of two scans each."""

    def prepare(root: Path, write_labelled: WriteScan) -> tuple[list[str], Path]:
        for sequence in ("00", "01", "02", "03"):
            folder = root / "sequences" / sequence
            for frame in (f"{sequence}0000", f"{sequence}0001"):
                scan, label = folder / scans / f"{frame}.bin", folder / labels / f"{frame}.label"
                write_labelled(scan, label, rain)
        return ["--data.split", SPLIT, "--data.loading.workers", "0"], folder / scans

    return prepare


def sequence_36(root: Path, write_labelled: WriteScan) -> tuple[list[str], Path]:
    """The scans of WADS's sequence 36 that the patterns of the configuration name."""
    folder = root / "sequences/36"
    for frame in ("042220", "042231", "042233", "042235", "042237", "042239", "042241"):
        write_labelled(folder / f"velodyne/{frame}.bin", folder / f"labels/{frame}.label", 110)
    write_labelled(root / "sample.bin", root / "sample.label", 110)
    return [], root


def small_track(root: Path, write_labelled: WriteScan) -> tuple[list[str], Path]:
    """Nothing but options: the data set is made at its first use."""
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    campaign = {
        **{"train": 2, "validation": 1, "test": 1, "scans": 1, "rain_rates": "[50.0]"},
        **{"sensor.rows": 16, "sensor.columns": 60},
    }
    options = [f"--data.campaign.{name}={value}" for name, value in campaign.items()]
    return options, root / "sequences/003/lidar_radar_pcd"


def taught_scenes(root: Path, write_labelled: WriteScan) -> tuple[list[str], Path]:
    """Three scenes that a filter has taught; the last is held out."""
    drive = root.with_name("drive")
    for number in range(3):
        write_labelled(drive / f"velodyne/{number}.bin", drive / f"labels/{number}.label", 1)
    teach(FilterDerainer(DROR()), named_frames([drive / "velodyne"]), root)
    held_out = root.with_name("held_out")
    held_out.mkdir()
    (held_out / "2.bin").symlink_to((drive / "velodyne/2.bin").absolute())
    return [], held_out


DATA_SETS: dict[str, Prepare] = {
    "rehearse3d": in_sequences("lidar_radar_pcd", "lidar_radar_labels", rain=3),
    "simulated": small_track,
    "taught": taught_scenes,
    "wads": in_sequences("velodyne", "labels", rain=110),
    "wads36": sequence_36,
}

NARROW = ["--model.width", "4"]
SMALL_GRID = ["--model.grid", "{rows: 18, columns: 60, inclination: [-30, 20]}"]

# What makes a network on range images quick; the simulated sensor's fitted grid is small itself.
QUICK_MODELS = {
    f"{network}_{data}.yaml": NARROW + (SMALL_GRID if data != "simulated" else [])
    for network in ("salsanext", "salsanext_lite", "lisnownet")
    for data in DATA_SETS
}

PREPARATIONS = {
    f"{network}_{data}.yaml": prepare
    for network in ("lisnownet", "outdet", "salsanext_lite", "salsanext")
    for data, prepare in DATA_SETS.items()
    # It needs no teacher, and has a test of its own without labels.
    if (network, data) not in (("lisnownet", "taught"), ("lisnownet", "rehearse3d"))
}

# A test, predictions and an export take longer than a step of training, and depend on the network:
# each network once, and each on another data set.
DEPLOYED = (
    "lisnownet_wads.yaml",
    "outdet_wads36.yaml",
    "salsanext_lite_taught.yaml",
    "salsanext_simulated.yaml",
)


def test_every_packaged_configuration_is_put_to_the_test() -> None:
    with_tests_of_their_own = {
        *("lisnownet_rehearse3d.yaml", "outdet_mixture.yaml"),
        *("cued_outdet_worlds.yaml", "relative_outdet_worlds.yaml"),
    }
    assert packaged_configs().keys() - with_tests_of_their_own == PREPARATIONS.keys()


def test_3d_outdet_learns_from_every_point_of_the_ten_scans() -> None:
    # As its figures in BENCHMARK.md were measured; bounds are for the export.
    config = yaml.safe_load(packaged_configs()["outdet_wads36.yaml"].read_text())
    assert "candidates" not in config["model"]["init_args"]


@pytest.mark.usefixtures("one_block", "two_sizes")
@pytest.mark.parametrize(("config", "prepare"), PREPARATIONS.items(), ids=PREPARATIONS.keys())
def test_a_packaged_configuration_is_trained_and_some_are_measured_and_deployed(
    run_derain,
    succeed,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    write_labelled: WriteScan,
    config: str,
    prepare: Prepare,
) -> None:
    monkeypatch.chdir(tmp_path)
    options, test_folder = prepare(Path("data"), write_labelled)
    options += QUICK_MODELS.get(config, [])
    data = ["--config", config, "--data.root", "data", *options, *QUICK]
    run = Path("runs") / config.removesuffix(".yaml")

    assert run_derain("fit", *data, *ONE_STEP).code == 0
    checkpoint = run / "version_0/checkpoints/last.ckpt"
    assert {path.name for path in checkpoint.parent.iterdir()} == {"best.ckpt", "last.ckpt"}
    assert list((run / "version_0").glob("events.out.tfevents.*"))
    stored = yaml.safe_load((run / "version_0/config.yaml").read_text())
    assert stored["data"]["init_args"]["root"] == "data"
    if config not in DEPLOYED:
        return

    outcome = succeed("test", *data, "--ckpt_path", checkpoint)
    assert "pooled over points" in outcome.out
    report = json.loads((run / "version_0/test.json").read_text())
    scans = sorted(test_folder.glob("*.bin"))
    assert report["scans"] == len(scans) > 0
    assert all(score is None or 0 <= score <= 1 for score in report["scores"].values())

    # As the deployed model computes, whatever the training did.
    exact = ["--trainer.precision", "32"]
    assert run_derain("predict", *data, *exact, "--ckpt_path", checkpoint).code == 0
    # The whole proof has tests of its own.
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])
    timed_on = ["--scan", scans[0], "--repeats", "1"]
    assert run_derain("export", checkpoint, "--out", "model.onnx", *timed_on).code == 0
    derainer = Derainer("model.onnx")
    for scan in scans:
        label = np.fromfile(Path("predictions") / f"{scan.stem}.label", "<u4")
        np.testing.assert_array_equal(label, derainer(read_scan(scan)))


@pytest.mark.usefixtures("two_sizes")
def test_lisnownet_is_trained_without_a_label_in_the_whole_data_set(
    run_derain, tmp_path: Path, monkeypatch: pytest.MonkeyPatch, write_labelled: WriteScan
) -> None:
    monkeypatch.chdir(tmp_path)
    config = "lisnownet_rehearse3d.yaml"
    options, _ = DATA_SETS["rehearse3d"](Path("data"), write_labelled)
    for label in Path("data").rglob("*.label"):
        label.unlink()
    data = ["--config", config, "--data.root", "data", *options, *QUICK_MODELS[config], *QUICK]
    assert run_derain("fit", *data, *ONE_STEP).code == 0
    best = Path("runs/lisnownet_rehearse3d/version_0/checkpoints/best.ckpt")
    assert load_model(best).spec.data == "REHEARSE-3D"
    # It cannot be measured, but it can be used.
    refusal = run_derain("test", *data, "--ckpt_path", best)
    assert refusal.code == 2
    assert "030000.bin: its labels are not at" in refusal.err.splitlines()[-1]
    assert run_derain("predict", *data, "--ckpt_path", best).code == 0
    assert len(list(Path("predictions").glob("*.label"))) == 2
