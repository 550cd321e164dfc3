"""The packaged mixture trains and predicts, on two small made-up data sets."""

import json
from itertools import chain
from pathlib import Path

import numpy as np
from recorded_scenes import write_wads

from derain.cards.card import load_card
from derain.models.checkpoint import load_model
from derain.simulation.manifest import MAKER, MANIFEST

QUICK = [
    *("--trainer.enable_progress_bar", "false", "--trainer.max_epochs", "1"),
    *("--panels.scans", "0", "--data.scans_per_epoch", "3"),
]


def test_the_packaged_mixture_goes_from_training_to_predictions(succeed, write_labelled) -> None:
    streets = Path("streets/sequences")
    write_wads(Path("WADS"), *chain(*load_card("wads").split.values()))
    for sequence in ("000", "001", "002"):
        folder = streets / sequence
        scan, label = folder / "lidar_radar_pcd/0.bin", folder / "lidar_radar_labels/0.label"
        write_labelled(scan, label, rain=3)
    split = {"train": ["000"], "validation": ["001"], "test": ["002"]}
    manifest = {"made_by": MAKER, "split": split, "files": {}}
    (streets.parent / MANIFEST).write_text(json.dumps(manifest))

    data = ["--config", "outdet_mixture.yaml", *QUICK]
    succeed("fit", *data, "--data.weights.snow", "2")
    checkpoint = Path("runs/outdet_mixture/version_0/checkpoints/best.ckpt")
    spec = load_model(checkpoint).spec
    assert spec.data == "WADS + simulated rain"
    assert spec.training["sequences of WADS"] == tuple(sorted(load_card("wads").split["train"]))
    assert len(spec.training["scans"]) == 1

    succeed("predict", *data, "--ckpt_path", checkpoint)
    written = sorted(Path("predictions").rglob("*.label"))
    assert [path.relative_to("predictions").parts[0] for path in written] == [
        *["snow"] * len(load_card("wads").split["test"]),
        "streets",
    ]
    assert all(len(np.fromfile(path, "<u4")) == 300 for path in written)
