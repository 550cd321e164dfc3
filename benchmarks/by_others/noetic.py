"""Bags of ROS 1, made and read by ROS itself: nothing here is derain's, nor of its libraries.

    apt-get install python3-rosbag python3-sensor-msgs       # Debian bookworm
    P="/usr/bin/python3 benchmarks/by_others/noetic.py"
    $P make bags ../shared/data/wads/drive/velodyne --scans 5
    derain run ../shared/data/wads/drive/velodyne/*00?.bin --out masks
    for kind in none bz2 lz4; do
        derain run bags/$kind.bag --out cleaned
        $P compare bags/$kind.bag cleaned/$kind.bag masks
    done

Needs ROS's own interpreter, and NumPy.
"""

import sys

import genpy
import numpy as np
import rosbag
from comparison import (
    PERIOD,
    POINTS,
    START,
    make_or_compare,
    messages_that_stay,
    points_that_stay,
)
from sensor_msgs import point_cloud2
from sensor_msgs.msg import Imu, PointCloud2, PointField
from std_msgs.msg import Header, String


def make_bags(folder, scans):
    """A bag of each compression."""
    folder.mkdir(parents=True, exist_ok=True)
    for compression in ("none", "bz2", "lz4"):
        make_bag(folder / f"{compression}.bag", compression, scans)


def make_bag(path, compression, scans):
    """A bag of small chunks, with a latched text, and stamps other than times of recording."""
    latched = {
        "topic": "/driver",
        "type": String._type,
        "md5sum": String._md5sum,
        "message_definition": String._full_text,
        "callerid": "/driver_node",
        "latching": "1",
    }
    with rosbag.Bag(str(path), "w", compression=compression, chunk_threshold=200_000) as bag:
        for number, scan in enumerate(scans):
            time = START + number * PERIOD
            bag.write(
                "/driver", String(data=f"cloud {number}"), at(time), connection_header=latched
            )
            bag.write("/imu/data", Imu(header=header(number, time, "imu")), at(time))
            bag.write(POINTS, cloud(scan, number, time - 1000), at(time))


def at(nanoseconds):
    """A time of ROS."""
    return genpy.Time(nanoseconds // 10**9, nanoseconds % 10**9)


def header(number, time, frame):
    """The header of a sensor's message."""
    return Header(seq=number, stamp=at(time), frame_id=frame)


def cloud(scan, number, time):
    """A cloud as Velodyne's driver lays it out: 22 bytes a point, ring and time after intensity."""
    points = np.fromfile(scan, "<f4").reshape(-1, 4)
    layout = [("x", "<f4"), ("y", "<f4"), ("z", "<f4"), ("intensity", "<f4")]
    table = np.zeros(len(points), [*layout, ("ring", "<u2"), ("time", "<f4")])
    for column, (name, _) in zip(points.T, layout, strict=False):
        table[name] = column
    table["ring"] = np.arange(len(points)) % 64
    fields = [
        PointField(name, table.dtype.fields[name][1], 4 if name == "ring" else 7, 1)
        for name in table.dtype.names
    ]
    size = table.dtype.itemsize
    return PointCloud2(
        header=header(number, time, "velodyne"),
        height=1,
        width=len(table),
        fields=fields,
        is_bigendian=False,
        point_step=size,
        row_step=size * len(table),
        data=table.tobytes(),
        is_dense=True,
    )


def compare_bags(before, after, masks):
    """Compares message by message."""
    head = "order, topics and stamps", 2
    return {
        **messages_that_stay(messages(before), messages(after), head),
        "connection headers": connections(before) == connections(after),
        "types, counts and compression": summary(before) == summary(after),
        "headers of clouds": headers(before) == headers(after),
        **points_that_stay(clouds(before), clouds(after), masks),
    }


def messages(path):
    """Topic, time, type, hash and bytes of all messages, in ROS's order."""
    with rosbag.Bag(str(path)) as bag:
        return [
            (topic, time.to_nsec(), raw[0], raw[2], bytes(raw[1]))
            for topic, raw, time in bag.read_messages(raw=True)
        ]


def clouds(path):
    """All columns of all clouds, as ROS reads their points."""
    with rosbag.Bag(str(path)) as bag:
        return [
            np.array(list(point_cloud2.read_points(message)))
            for _, message, _ in bag.read_messages([POINTS])
        ]


def headers(path):
    """Headers of all clouds."""
    with rosbag.Bag(str(path)) as bag:
        return [message.header for _, message, _ in bag.read_messages([POINTS])]


def connections(path):
    """Publishers of the connections: definition, caller, latching."""
    with rosbag.Bag(str(path)) as bag:
        return sorted(sorted(each.header.items()) for each in bag._connections.values())


def summary(path):
    """The topics and the compression that `rosbag info` prints."""
    with rosbag.Bag(str(path)) as bag:
        types, topics = bag.get_type_and_topic_info()
        counted = {name: (topic.msg_type, topic.message_count) for name, topic in topics.items()}
        kind = bag.get_compression_info().compression
        return types, counted, kind, bag.get_start_time(), bag.get_end_time()


if __name__ == "__main__":
    sys.exit(make_or_compare(__doc__, make_bags, compare_bags))
