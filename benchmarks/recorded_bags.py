"""Bags as a robot records them: a LiDAR's clouds among an IMU's readings and texts.

Messages other than the clouds, and the bags, are written by the library that derain reads bags by;
the clouds too where :func:`cloud_of` makes them, so that nothing of derain judges itself.
"""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rosbags import rosbag1, rosbag2
from rosbags.interfaces import (
    Qos,
    QosDurability,
    QosHistory,
    QosLiveliness,
    QosReliability,
    QosTime,
)
from rosbags.typesys import Stores, get_typestore

from derain.scan import Array

Storage = Literal["sqlite3", "mcap", "ros1"]
STORAGES: Sequence[Storage] = ("sqlite3", "mcap", "ros1")

POINTS, IMU, TEXT = "/velodyne_points", "/imu/data", "/driver"
CLOUD_TYPE, IMU_TYPE, TEXT_TYPE = (
    "sensor_msgs/msg/PointCloud2",
    "sensor_msgs/msg/Imu",
    "std_msgs/msg/String",
)

# PointField's datatypes, by NumPy's names.
CODES = {"int8": 1, "uint8": 2, "int16": 3, "uint16": 4}
CODES |= {"int32": 5, "uint32": 6, "float32": 7, "float64": 8}

START, PERIOD = 1_700_000_000_123_456_789, 100_000_000  # nanoseconds

NO_TIME = QosTime(0, 0)
SENSOR_QOS = Qos(
    QosHistory.KEEP_LAST,
    5,
    QosReliability.BEST_EFFORT,
    QosDurability.VOLATILE,
    NO_TIME,
    NO_TIME,
    QosLiveliness.AUTOMATIC,
    NO_TIME,
    False,
)


@dataclass(frozen=True)
class Recorded:
    """One message that is recorded.

    Attributes:
        topic: Its topic.
        type: Type of its message.
        time: Nanoseconds.
        message: The message, as the library has it; or its bytes.
    """

    topic: str
    type: str
    time: int
    message: Any


class Ros:
    """The messages of ROS 1 or ROS 2.

    Args:
        storage: Where they are to be recorded.
    """

    def __init__(self, storage: Storage) -> None:
        self.is_ros1 = storage == "ros1"
        self.store = get_typestore(Stores.ROS1_NOETIC if self.is_ros1 else Stores.ROS2_HUMBLE)

    def new(self, type_: str, **members: Any) -> Any:
        """A message."""
        return self.store.types[type_](**members)

    def header(self, time: int, frame: str = "velodyne") -> Any:
        """The header of a sensor's message."""
        stamp = self.new("builtin_interfaces/msg/Time", sec=time // 10**9, nanosec=time % 10**9)
        counter = {"seq": 7} if self.is_ros1 else {}
        return self.new("std_msgs/msg/Header", stamp=stamp, frame_id=frame, **counter)

    def cloud(self, table: Array, time: int, *, shape: tuple[int, int] | None = None) -> Any:
        """A PointCloud2 of a structured array, with the gaps and the byte order that it has."""
        assert table.dtype.fields is not None
        fields = []
        big = False
        for name, (dtype, offset, *_) in table.dtype.fields.items():
            big = big or dtype.base.byteorder == ">"
            fields.append(
                self.new(
                    "sensor_msgs/msg/PointField",
                    name=name,
                    offset=offset,
                    datatype=CODES[dtype.base.newbyteorder("=").name],
                    count=int(np.prod(dtype.shape)) if dtype.shape else 1,
                )
            )
        height, width = shape or (1, len(table))
        return self.new(
            CLOUD_TYPE,
            header=self.header(time),
            height=height,
            width=width,
            fields=fields,
            is_bigendian=big,
            point_step=table.dtype.itemsize,
            row_step=width * table.dtype.itemsize,
            data=np.frombuffer(table.tobytes(), np.uint8),
            is_dense=True,
        )

    def imu(self, time: int, value: float) -> Any:
        """A reading of an IMU."""
        vector = self.new("geometry_msgs/msg/Vector3", x=value, y=-value, z=9.81)
        turn = self.new("geometry_msgs/msg/Quaternion", x=0.0, y=0.0, z=0.0, w=1.0)
        unknown = np.full(9, -1.0)
        return self.new(
            IMU_TYPE,
            header=self.header(time, "imu"),
            orientation=turn,
            orientation_covariance=unknown,
            angular_velocity=vector,
            angular_velocity_covariance=unknown,
            linear_acceleration=vector,
            linear_acceleration_covariance=unknown,
        )

    def text(self, text: str) -> Any:
        """A text."""
        return self.new(TEXT_TYPE, data=text)

    def to_bytes(self, message: Any, type_: str) -> bytes:
        """A message as it is sent."""
        if isinstance(message, bytes):
            return message
        serialize = self.store.serialize_ros1 if self.is_ros1 else self.store.serialize_cdr
        return bytes(serialize(message, type_))


def drive(ros: Ros, tables: Iterable[Array]) -> list[Recorded]:
    """Clouds at ten a second, each after two readings of an IMU and a text of the same time."""
    messages = []
    for number, table in enumerate(tables):
        time = START + number * PERIOD
        for part in (0, PERIOD // 2):
            reading = ros.imu(time - PERIOD + part, 0.1 * number + part / PERIOD)
            messages.append(Recorded(IMU, IMU_TYPE, time - PERIOD + part, reading))
        messages.append(Recorded(TEXT, TEXT_TYPE, time, ros.text(f"cloud {number} ✓")))
        messages.append(Recorded(POINTS, CLOUD_TYPE, time, ros.cloud(table, time - 1000)))
    return messages


def write_bag(path: Path, storage: Storage, messages: Iterable[Recorded]) -> Path:
    """Records messages.

    Args:
        path: A new file of ROS 1, or a new folder of ROS 2.
        storage: How they are stored.
        messages: The messages, in time order.
    """
    ros = Ros(storage)
    connections: dict[tuple[str, str], Any] = {}
    with _writer(path, storage) as writer:
        for each in messages:
            key = each.topic, each.type
            if key not in connections:
                connections[key] = writer.add_connection(
                    *key, typestore=ros.store, **_details(storage)
                )
            writer.write(connections[key], each.time, ros.to_bytes(each.message, each.type))
    return path


def read_bag(path: Path) -> list[tuple[str, str, int, bytes]]:
    """Topic, type, time and bytes of every message, in the order that the library gives."""
    reader = rosbag1.Reader(path) if path.suffix == ".bag" else rosbag2.Reader(path)
    with reader:
        return [(c.topic, c.msgtype, time, bytes(data)) for c, time, data in reader.messages()]


def connections_of(path: Path) -> list[tuple[Any, ...]]:
    """The connections of a bag: each of its topics, in its order."""
    reader = rosbag1.Reader(path) if path.suffix == ".bag" else rosbag2.Reader(path)
    with reader:
        return [(c.topic, c.msgtype, c.msgdef, c.digest, c.ext) for c in reader.connections]


def table_of(columns: Mapping[str, Array]) -> Array:
    """Columns as one structured array, packed."""
    size = len(next(iter(columns.values())))
    table = np.empty(size, [(name, column.dtype) for name, column in columns.items()])
    for name, column in columns.items():
        table[name] = column
    return table


def _writer(path: Path, storage: Storage) -> Any:
    if storage == "ros1":
        return rosbag1.Writer(path)
    plugin = rosbag2.StoragePlugin[storage.upper()]
    return rosbag2.Writer(path, version=8, storage_plugin=plugin)


def _details(storage: Storage) -> dict[str, Any]:
    """Further settings of a topic: latching in ROS 1, quality of service in ROS 2."""
    if storage == "ros1":
        return {"callerid": "/velodyne_driver", "latching": 1}
    return {"offered_qos_profiles": [SENSOR_QOS]}
