"""The folder and the names with which examples in docstrings are run."""

import shutil
from pathlib import Path

import numpy as np

from derain.files.labels import write_labels
from derain.scan import Float32s, Ints

KEPT = Path(__file__).parent / "export" / "kept"

# Ids of the data card of WADS.
BUILDING, FALLING_SNOW = 50, 110


def wall_and_drops() -> tuple[Float32s, Ints]:
    """A scan in which every filter finds the rain and nothing else, and its labels.

    Returns:
        x, y, z in metres and intensity 0..255, float32 (820, 4): a wall of 800 points, 20 m ahead,
        and 20 drops before it, which return next to nothing; and the class of each, int64 (820,).
    """
    y, z = np.meshgrid(np.arange(40) * 0.05 - 1, np.arange(20) * 0.05 - 0.5)
    wall = np.stack([np.full(800, 20.0), y.ravel(), z.ravel(), np.full(800, 40.0)], axis=1)
    generator = np.random.default_rng(0)
    place = generator.uniform([3, -3, -1], [10, 3, 2], (20, 3))
    drops = np.column_stack([place, np.zeros(20)])
    label = np.repeat([BUILDING, FALLING_SNOW], [800, 20])
    return np.concatenate([wall, drops]).astype(np.float32), label


def prepare(folder: Path) -> None:
    """Puts what the examples read into a folder: a scan, its labels, a model and its checkpoint."""
    points, label = wall_and_drops()
    points.tofile(folder / "scan.bin")
    write_labels(folder / "scan.label", label)
    shutil.copy(KEPT / "outdet.onnx", folder / "model.onnx")
    shutil.copy(KEPT / "outdet.ckpt", folder / "model.ckpt")
