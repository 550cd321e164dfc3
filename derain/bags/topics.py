"""The topics of a bag, and which of them holds the point clouds that a user means.

Most drivers of LiDARs publish the packets of the sensor, and a second node decodes them. Many bags
hold the packets alone, for they are smaller.
"""

from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from derain.errors import InputError

# ROS 1 calls it sensor_msgs/PointCloud2; the readers give both the longer name.
POINT_CLOUD = "sensor_msgs/msg/PointCloud2"

# Type of a message that is no point cloud → what makes point clouds of it.
PACKET_DECODERS = {
    "velodyne_msgs/VelodyneScan": "velodyne_pointcloud's transform node",
    "ouster_sensor_msgs/PacketMsg": "ouster_ros (os_cloud, or its replay launch file)",
    "ouster_msgs/PacketMsg": "ouster_ros (os_cloud, or its replay launch file)",
    "ouster_ros/PacketMsg": "ouster_ros (os_cloud, or its replay launch file)",
    "livox_ros_driver/CustomMsg": "livox_ros_driver with xfer_format 0, or a livox converter",
    "livox_ros_driver2/CustomMsg": "livox_ros_driver2 with xfer_format 0, or a livox converter",
    "livox_interfaces/CustomMsg": "livox_ros2_driver with xfer_format 0, or a livox converter",
    "hesai_ros_driver/UdpFrame": "hesai_ros_driver, or nebula",
    "pandar_msgs/PandarScan": "hesai's pandar_pointcloud, or nebula",
    "nebula_msgs/NebulaPackets": "nebula",
    "rslidar_msg/RslidarPacket": "rslidar_sdk",
    "rslidar_msgs/rslidarScan": "rslidar_pointcloud, or rslidar_sdk",
    "sensor_msgs/PointCloud": "point_cloud_converter",
    "sensor_msgs/LaserScan": "laser_geometry, though it is one line and no cloud",
}


@dataclass(frozen=True)
class Topic:
    """One topic of a bag.

    Attributes:
        name: Its name.
        type: Type of its messages.
        messages: Their number, by the bag's index.
        encoding: Name of the encoding: ``ros1``, ``cdr``, or in MCAP any other.
    """

    name: str
    type: str
    messages: int
    encoding: str

    def has(self, connection: Any) -> bool:
        """True if a reader's connection belongs to it; several publishers share a topic."""
        return bool(connection.topic == self.name and connection.msgtype == self.type)

    def __str__(self) -> str:
        return f"{self.name} ({self.type}, {self.messages:,})"


def cloud_topic(bag: Path, topics: Sequence[Topic], name: str = "") -> Topic:
    """Chooses a topic of point clouds.

    Args:
        bag: The bag's path, for the errors.
        topics: Its topics.
        name: Name of the topic; empty where the bag has only one of point clouds.

    Raises:
        InputError: No such topic, one of another type, none at all, or several.
    """
    wanted = name.strip("/")
    named = [topic for topic in topics if not name or topic.name.strip("/") == wanted]
    clouds = [topic for topic in named if topic.type == POINT_CLOUD and (name or topic.messages)]
    if len(clouds) == 1:
        return clouds[0]
    if clouds:
        raise InputError(
            bag,
            f"has {len(clouds)} topics of point clouds: {_listed(clouds)}",
            f"Name one with --topic, or as {bag}{clouds[0].name}.",
        )
    if topics and not named:
        raise InputError(bag, f"has no topic {name}", f"Its topics: {_listed(topics)}.")
    raise InputError(
        bag,
        f"holds no point clouds ({POINT_CLOUD}), but {_listed(named)}",
        _remedy_without_clouds(named),
    )


def decoder_of(message_type: str) -> str | None:
    """The node that converts a type of message to PointCloud2; None if it is not known.

    Args:
        message_type: Its type, such as ``velodyne_msgs/msg/VelodyneScan``.
    """
    return PACKET_DECODERS.get(message_type.replace("/msg/", "/"))


def _listed(topics: Iterable[Topic]) -> str:
    return ", ".join(map(str, topics)) or "none"


def _remedy_without_clouds(topics: Iterable[Topic]) -> str:
    for topic in topics:
        if decoder := decoder_of(topic.type):
            return (
                f"{topic.name} is what a sensor or another node sent: {decoder} makes point clouds "
                "of it. Play the bag through that, and record what it publishes."
            )
    return "Record the topic of point clouds, or name it with --topic."
