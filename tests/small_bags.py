"""Small bags in every storage, and the same scans as files."""

import sqlite3
from collections.abc import Callable, Iterable
from contextlib import closing
from pathlib import Path
from typing import Any

import numpy as np
import yaml

from benchmarks.recorded_bags import Recorded, Ros, Storage, drive, table_of, write_bag
from derain.bags.bag import Bag
from derain.bags.bag_copy import BagCopy
from derain.bags.names import written_name
from derain.evaluation.hard_cases import scene
from derain.scan import Array

POINTS = 300


def tables(number: int = 3, points: int = POINTS) -> list[Array]:
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
    clouds: Iterable[Array] | None = None,
    more: Iterable[Recorded] = (),
) -> Path:
    """A bag of clouds, of an IMU and of texts, and of what else there is to be in it."""
    messages = [*drive(Ros(storage), tables() if clouds is None else clouds), *more]
    messages.sort(key=lambda each: each.time)
    return write_bag(bag_path(folder, storage, name), storage, messages)


def storage_file(bag: Path) -> Path:
    """The file of a bag that holds its messages."""
    return bag if bag.is_file() else next(p for p in bag.iterdir() if p.suffix != ".yaml")


def copied(path: Path, out: Path) -> Path:
    """A copy of a bag in a folder that is made."""
    bag = Bag(path)
    out.mkdir()
    name = written_name(path, path.is_file())
    with BagCopy(bag, bag.cloud_topic(), out / name) as copy:
        return copy.finish()


def change_database(bag: Path, statement: str) -> None:
    """Changes a bag's messages, or what else its database holds, by SQL."""
    with closing(sqlite3.connect(storage_file(bag))) as database, database:
        database.execute(statement)


def change_metadata(bag: Path, change: Callable[[dict[str, Any]], object]) -> None:
    """Changes what ROS 2 writes beside a bag's messages, which stay as they are."""
    path = bag / "metadata.yaml"
    metadata = yaml.safe_load(path.read_text("utf-8"))
    change(metadata["rosbag2_bagfile_information"])
    path.write_text(yaml.safe_dump(metadata), "utf-8")


def topic_of(information: dict[str, Any], name: str) -> dict[str, Any]:
    """What the metadata of a bag state of a topic."""
    topics = information["topics_with_message_count"]
    return next(each for each in topics if each["topic_metadata"]["name"] == name)
