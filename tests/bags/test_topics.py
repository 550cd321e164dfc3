"""Which topic of a bag holds the point clouds that a user means."""

from pathlib import Path

import pytest

from derain.bags.topics import POINT_CLOUD, Topic, cloud_topic
from derain.errors import InputError

BAG = Path("drive.mcap")
FRONT, REAR = (Topic(f"/{name}/points", POINT_CLOUD, 3, "cdr") for name in ("front", "rear"))
EMPTY = Topic("/empty", POINT_CLOUD, 0, "cdr")
IMU = Topic("/imu/data", "sensor_msgs/msg/Imu", 1000, "cdr")
PACKETS = Topic("/packets", "velodyne_msgs/msg/VelodyneScan", 3, "cdr")


@pytest.mark.parametrize(
    ("topics", "name", "chosen"),
    [
        ([IMU, EMPTY, FRONT], "", FRONT),
        ([FRONT, REAR], "rear/points", REAR),
        ([FRONT, EMPTY], "/empty", EMPTY),
    ],
)
def test_the_topic_is_the_named_one_or_the_only_one(topics, name, chosen) -> None:
    assert cloud_topic(BAG, topics, name) == chosen


@pytest.mark.parametrize(
    ("topics", "name", "words"),
    [
        ([FRONT, REAR], "", ["/front/points", "/rear/points", "--topic"]),
        ([FRONT, IMU], "imu/data", ["no point clouds", "/imu/data (sensor_msgs/msg/Imu, 1,000)"]),
        ([FRONT, IMU], "points", ["no topic points", "/front/points"]),
        ([IMU], "", ["no point clouds", "/imu/data (sensor_msgs/msg/Imu, 1,000)"]),
        ([], "", ["no point clouds"]),
        ([PACKETS], "packets", ["/packets", "velodyne_pointcloud"]),
    ],
)
def test_a_refusal_names_the_topics_and_what_to_do(topics, name, words) -> None:
    with pytest.raises(InputError) as error:
        cloud_topic(BAG, topics, name)
    assert not [word for word in words if word not in str(error.value)]
