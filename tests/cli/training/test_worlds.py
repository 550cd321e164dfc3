"""The configuration of the model that comes with derain: worlds are made, and trained on."""

from pathlib import Path

import yaml

from derain.models.checkpoint import load_model
from derain.models.cues import CueFusion
from derain.workflows.configurations import packaged_configs


def test_worlds_are_made_and_trained_on(succeed, small_world) -> None:
    config = yaml.safe_load(packaged_configs()["cues_worlds.yaml"].read_text("utf-8"))
    for part in config["data"]["init_args"]["parts"].values():
        part["init_args"]["campaign"] |= {"world": str(small_world), "train": 2, "validation": 1}
        part["init_args"]["workers"] = 1
    Path("worlds.yaml").write_text(yaml.safe_dump(config), "utf-8")
    options = [
        *("--data.scans_per_epoch", 8, "--data.loading.workers", 0),
        *("--trainer.max_epochs", 1, "--trainer.check_val_every_n_epoch", 1),
        *("--trainer.enable_progress_bar", "false", "--panels.scans", 0),
    ]
    succeed("fit", "--config", "worlds.yaml", *options)
    (checkpoint,) = Path("runs/cues_worlds").rglob("last.ckpt")
    model = load_model(checkpoint)
    assert isinstance(model, CueFusion)
    assert model.spec.data == "simulated rain"
