"""Every command of derain that writes, on inputs so small that it takes seconds.

The demonstration is not among them: it runs others.
"""

from collections.abc import Callable
from pathlib import Path

import numpy as np
import torch

from benchmarks.recorded_bags import Ros, Storage, drive, table_of, write_bag
from derain.cards.card import load_card
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.models.checkpoint import save_model
from derain.models.outdet import PUBLISHED_KEYS, OutDet

POINTS, RAIN = 600, 110

SCENE = "road: [[2, -10], [60, -10], [60, 10], [2, 10]]\n"
PLACE = "{x: 0.5, y: 0, z: -0.7, roll: 0, pitch: 0, yaw: 90}\n"

# A filter calls much of a made-up scan rain.
ALL = ("--most-removed", "1")

SPLIT = '{train: ["00"], validation: ["01"], test: ["02"]}'


class SmallInputs:
    """Inputs of the commands, each made at its first use.

    Args:
        folder: A new folder for them.
    """

    def __init__(self, folder: Path) -> None:
        folder.mkdir()
        self.folder = folder

    def data(self) -> Path:
        """A data set in the layout of WADS: three sequences of two labelled scans."""
        for number in range(6):
            sequence = self.folder / f"data/sequences/{number // 2:02d}"
            _write_scan(sequence / f"velodyne/{number:06d}.bin", POINTS, number)
            labels = RAIN * (np.arange(POINTS) >= 0.9 * POINTS)
            write_labels(sequence / f"labels/{number:06d}.label", labels)
        return self.folder / "data"

    def scans(self) -> Path:
        """Folder of two labelled scans."""
        return self.data() / "sequences/00/velodyne"

    def bag(self, storage: Storage) -> Path:
        """A bag of twenty clouds."""
        path = self.folder / ("drive.bag" if storage == "ros1" else f"drive_{storage}")
        columns = ("x", "y", "z", "intensity")
        points = (scene(POINTS, seed=number).T for number in range(20))
        tables = [table_of(dict(zip(columns, each, strict=True))) for each in points]
        return write_bag(path, storage, drive(Ros(storage), tables))

    def radar(self) -> Path:
        """Folder of two radar frames, at the times of the scans."""
        for number in range(2):
            _write_scan(self.folder / f"radar/{number:06d}.bin", 50, 100 + number)
        for folder in (self.scans(), self.folder / "radar"):
            (folder / "metadata.csv").write_text("frame,timestamp\n000000,0.0\n000001,0.1\n")
        return self.folder / "radar"

    def text(self, name: str, content: str) -> Path:
        """A small file."""
        (self.folder / name).write_text(content)
        return self.folder / name

    def checkpoint(self) -> Path:
        """A 3D-OutDet of random weights."""
        model = OutDet()
        model.adopt(model.spec_for(load_card("wads")))
        save_model(model, self.folder / "outdet.ckpt")
        return self.folder / "outdet.ckpt"

    def weights(self) -> Path:
        """Such weights as they are published."""
        tensors = OutDet().network.state_dict()
        published = {key: tensors[ours] for ours, key in PUBLISHED_KEYS.items()}
        torch.save(published, self.folder / "published.pt")
        return self.folder / "published.pt"


def _write_scan(path: Path, points: int, seed: int) -> None:
    path.parent.mkdir(parents=True, exist_ok=True)
    scene(points, seed=seed).tofile(path)


def _training(inputs: SmallInputs, subcommand: str, *options: str | Path) -> list[str | Path]:
    return [
        *(subcommand, "--config", "outdet_wads.yaml", "--data.root", inputs.data()),
        *("--data.split", SPLIT, "--trainer.enable_progress_bar", "false"),
        *("--trainer.logger.save_dir", "out", *options),
    ]


def _fit(inputs: SmallInputs, *options: str) -> list[str | Path]:
    short = ("--trainer.max_epochs", "3", "--panels.scans", "0", "--data.loading.workers", "1")
    return _training(inputs, "fit", *short, *options)


# Arguments of each command; it writes into the folder "out" of the folder where it is started.
COMMANDS: dict[str, Callable[[SmallInputs], list[str | Path]]] = {
    "run": lambda i: ["run", "dror", i.scans(), "--out", "out", *ALL],
    "run, ROS 1": lambda i: ["run", "dror", i.bag("ros1"), "--out", "out", *ALL],
    "run, SQLite": lambda i: ["run", "dror", i.bag("sqlite3"), "--out", "out", *ALL],
    "run, MCAP": lambda i: ["run", "dror", i.bag("mcap"), "--out", "out", *ALL],
    "teach": lambda i: ["teach", "dror", i.scans(), "--out", "out", "--card", "wads"],
    "bench": lambda i: [
        *("bench", "--data", i.scans(), "--card", "wads", "--methods", "dror", "dsor", "all"),
        *("--repeats", "1", "--out", "out"),
    ],
    "tune --storage": lambda i: [
        *("tune", "dsor", "--data", i.scans(), "--card", "wads", "--trials", "10"),
        *("--storage", "out/study.db", "--out", "out/best.yaml"),
    ],
    "view": lambda i: [
        *("view", i.scans() / "000000.bin", "--card", "wads", "--methods", "dror"),
        *("--out", "out/figure.png"),
    ],
    "export": lambda i: ["export", i.checkpoint(), "--out", "out/outdet.onnx"],
    "import-weights": lambda i: [
        *("import-weights", "outdet", i.weights(), "--stats", "wads", "--out", "out/outdet.ckpt"),
    ],
    "simulate": lambda _: [
        *("simulate", "--sensor", "mems_64", "--sequences", "3", "--scans", "2"),
        *("--workers", "2", "--out", "out"),
    ],
    "simulate --on": lambda i: [
        *("simulate", "--on", i.scans(), "--rain", "25", "--picture", "--out", "out"),
    ],
    "annotate": lambda i: [
        *("annotate", i.scans().parent, "--scene", i.text("scene.yaml", SCENE), "--out", "out"),
    ],
    "fuse": lambda i: [
        *("fuse", "--lidar", i.scans(), "--radar", i.radar(), "--out", "out"),
        *("--extrinsics", i.text("place.yaml", PLACE)),
    ],
    "info --picture": lambda i: [
        *("info", i.data(), "--card", "wads", "--picture", "out/statistics.png"),
    ],
    "fit": lambda i: _fit(i),
    "fit, two processes": lambda i: _fit(
        i, "--trainer.devices", "2", "--trainer.accelerator", "cpu", "--trainer.strategy", "ddp"
    ),
    "test": lambda i: _training(i, "test", "--ckpt_path", i.checkpoint()),
    "predict": lambda i: _training(
        i, "predict", "--ckpt_path", i.checkpoint(), "--predictions.folder", "out/labels"
    ),
}
