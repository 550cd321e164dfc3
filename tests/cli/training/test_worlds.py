"""The configuration of the model that comes with derain: worlds are made, and trained on."""

from pathlib import Path

import pytest
import yaml

from derain.errors import InputError
from derain.models.checkpoint import load_model
from derain.models.cues import CueFusion
from derain.system.open3d_import import import_open3d
from derain.workflows.configurations import packaged_configs

WORLD = """
places: {street: 1}
horizon: 0
carrier: 0
sensors: {kinds: {front: 1}, front_rows: [32], front_step: [0.5, 1.0]}
precipitation: {snow: {weight: 1, crowding: [0.1, 0.3]}}
"""


def test_worlds_are_made_and_trained_on(succeed) -> None:
    try:
        import_open3d()
    except InputError as error:
        pytest.skip(str(error))
    Path("small.yaml").write_text(WORLD, "utf-8")
    config = yaml.safe_load(packaged_configs()["cues_worlds.yaml"].read_text("utf-8"))
    for part in config["data"]["init_args"]["parts"].values():
        part["init_args"]["campaign"] |= {"world": "small.yaml", "train": 2, "validation": 1}
        part["init_args"]["workers"] = 1
    Path("worlds.yaml").write_text(yaml.safe_dump(config), "utf-8")
    options = [
        *("--data.scans_per_epoch", 8, "--data.loading.workers", 0),
        *("--trainer.max_epochs", 1, "--trainer.check_val_every_n_epoch", 1),
        *("--trainer.enable_progress_bar", "false", "--panels.scans", 0, "--errors.pictures", 0),
    ]
    succeed("fit", "--config", "worlds.yaml", *options)
    (checkpoint,) = Path("runs/cues_worlds").rglob("last.ckpt")
    model = load_model(checkpoint)
    assert isinstance(model, CueFusion)
    assert model.spec.data == "simulated rain"
