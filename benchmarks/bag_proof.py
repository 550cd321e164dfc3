"""Cleans real scans as bags, and compares them with the same scans cleaned as files.

    python -m benchmarks.bag_proof --shared ../shared
    python -m benchmarks.bag_proof --shared ../shared --scans 20 --reading

For each storage it makes a bag of the scans of a drive, of an IMU and of texts, runs `derain run`
on it, and compares message by message. With ``--reading`` it times reading the bags against reading
the files instead, in turns.
"""

import argparse
import sys
import tempfile
from collections.abc import Sequence
from pathlib import Path
from statistics import median
from typing import Any

import numpy as np

from benchmarks.recorded_bags import (
    IMU,
    POINTS,
    STORAGES,
    TEXT,
    Ros,
    Storage,
    connections_of,
    drive,
    read_bag,
    table_of,
    write_bag,
)
from benchmarks.turns import milliseconds_in_turns
from derain.cli.main import main as derain
from derain.files import read_scan
from derain.scan import Array, Bools
from derain.sources.folders import named_frames


def main() -> int:
    """Runs the proof; the exit code is 1 where anything is not as it should be."""
    parser = argparse.ArgumentParser(description=__doc__.split("\n", 1)[0])
    parser.add_argument("--shared", type=Path, required=True, help="folder of the real scans")
    parser.add_argument("--scans", type=int, default=5, help="(default: %(default)s)")
    parser.add_argument("--method", default="default", help="(default: %(default)s)")
    parser.add_argument("--reading", action="store_true", help="time reading instead")
    parser.add_argument("--rounds", type=int, default=5, help="of reading (default: %(default)s)")
    arguments = parser.parse_args()
    folder = arguments.shared / "data/wads/drive/velodyne"
    scans = sorted(folder.glob("*.bin"))[: arguments.scans]
    with tempfile.TemporaryDirectory() as work:
        root = Path(work)
        bags = {storage: _bag(root, storage, scans) for storage in STORAGES}
        if arguments.reading:
            _time_reading(scans, bags, arguments.rounds)
            return 0
        _run(arguments.method, scans, root / "files")
        _run(arguments.method, list(bags.values()), root / "cleaned")
        masks = [np.fromfile(root / "files" / f"{s.stem}.label", "<u4") == 1 for s in scans]
        proved = [
            _prove(storage, bag, root / "cleaned" / bag.name, masks)
            for storage, bag in bags.items()
        ]
    return 0 if all(proved) else 1


def _bag(root: Path, storage: Storage, scans: Sequence[Path]) -> Path:
    tables = [table_of(read_scan(scan).fields) for scan in scans]
    name = "drive.bag" if storage == "ros1" else f"drive_{storage}"
    return write_bag(root / name, storage, drive(Ros(storage), tables))


def _run(method: str, scans: Sequence[Path], out: Path) -> None:
    command = ["run", method, *map(str, scans), "--out", str(out)]
    if derain(command):
        sys.exit(f"derain {' '.join(command)} failed")


def _prove(storage: Storage, bag: Path, made: Path, masks: Sequence[Bools]) -> bool:
    """Compares a bag with its cleaned copy, by the library alone, and returns the differences."""
    before, after = read_bag(bag), read_bag(made)
    others = [(old, new) for old, new in zip(before, after, strict=False) if old[0] != POINTS]
    clouds = [_left(message, storage) for topic, _, _, message in after if topic == POINTS]
    expected = [
        points[~rain]
        for points, rain in zip(
            (_left(message, storage) for topic, _, _, message in before if topic == POINTS),
            masks,
            strict=True,
        )
    ]
    findings = {
        f"{len(before)} messages": len(before) == len(after),
        "order, topics and stamps": [m[:3] for m in before] == [m[:3] for m in after],
        "types, definitions, hashes, QoS, latching": connections_of(bag) == connections_of(made),
        f"{len(others)} messages of {IMU} and {TEXT}, byte for byte": all(
            old == new for old, new in others
        ),
        f"{sum(map(len, clouds)):,} points left of {sum(map(len, masks)):,}, those that files keep,"
        " byte for byte": all(map(np.array_equal, clouds, expected)),
    }
    for title, found in findings.items():
        print(f"{storage:8} {'same' if found else 'DIFFERENT':10} {title}")
    return all(findings.values())


def _left(message: bytes, storage: Storage) -> Array:
    """The points of a message, as the library reads it: rows of bytes."""
    ros = Ros(storage) if storage not in _ROS else _ROS[storage]
    _ROS[storage] = ros
    read = ros.store.deserialize_ros1 if ros.is_ros1 else ros.store.deserialize_cdr
    cloud = read(message, "sensor_msgs/msg/PointCloud2")
    points: Array = np.asarray(cloud.data).reshape(-1, cloud.point_step)
    return points


_ROS: dict[Storage, Ros] = {}


def _time_reading(scans: Sequence[Path], bags: dict[Storage, Path], rounds: int) -> None:
    """Times reading all the scans, the bags beside the files."""

    def reading(paths: Sequence[Path]) -> Any:
        def read() -> None:
            for frame in named_frames(paths):
                frame.read()

        return read

    functions = {"files": reading(scans), **{name: reading([bag]) for name, bag in bags.items()}}
    times = milliseconds_in_turns(functions, rounds)
    files = median(times["files"])
    for name, each in times.items():
        ratios = [a / b for a, b in zip(each, times["files"], strict=True)]
        print(
            f"reading {len(scans)} scans, {name:8} {median(each) / files:.2f} times the files "
            f"({min(ratios):.2f} to {max(ratios):.2f} by round)"
        )


if __name__ == "__main__":
    sys.exit(main())
