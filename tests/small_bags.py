"""Small bags in every storage, and the same scans as files."""

from collections.abc import Iterable
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from benchmarks.recorded_bags import Recorded, Ros, Storage, drive, table_of, write_bag
from derain.evaluation.hard_cases import scene

POINTS = 300


def tables(number: int = 3, points: int = POINTS) -> list[NDArray[Any]]:
    """Clouds with drops in them, as structured arrays of x, y, z, intensity and ring."""
    made = []
    for seed in range(number):
        columns = dict(zip(("x", "y", "z", "intensity"), scene(points, seed=seed).T, strict=True))
        made.append(table_of({**columns, "ring": np.arange(points, dtype=np.uint16) % 16}))
    return made


def bag_path(folder: Path, storage: Storage, name: str = "drive") -> Path:
    """Where a bag of a storage lies: a file of ROS 1, a folder of ROS 2."""
    return folder / (f"{name}.bag" if storage == "ros1" else name)


def small_bag(
    folder: Path,
    storage: Storage,
    name: str = "drive",
    clouds: Iterable[NDArray[Any]] | None = None,
    more: Iterable[Recorded] = (),
) -> Path:
    """A bag of clouds, of an IMU and of texts, and of what else there is to be in it."""
    messages = [*drive(Ros(storage), tables() if clouds is None else clouds), *more]
    messages.sort(key=lambda each: each.time)
    return write_bag(bag_path(folder, storage, name), storage, messages)


def storage_file(bag: Path) -> Path:
    """The file of a bag that holds its messages."""
    return bag if bag.is_file() else next(p for p in bag.iterdir() if p.suffix != ".yaml")
