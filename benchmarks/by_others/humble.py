"""Bags in SQLite as ROS 2 Humble records them, made and read by Python alone.

P="others/bin/python benchmarks/by_others/humble.py"      # as for foxglove.py, and pyyaml
$P make bags/humble ../shared/data/wads/drive/velodyne --scans 5
derain run ../shared/data/wads/drive/velodyne/*00?.bin --out masks
derain run bags/humble --out cleaned
$P compare bags/humble cleaned/humble masks

Ends with 1 where anything is not the same.
"""

import sqlite3
import sys

import numpy as np
import yaml
from comparison import (
    PERIOD,
    POINTS,
    START,
    make_or_compare,
    messages_that_stay,
    points_that_stay,
)
from foxglove import CLOUD, cloud_of
from mcap_ros2._dynamic import generate_dynamic, serialize_dynamic

TABLES = """
CREATE TABLE schema(schema_version INTEGER PRIMARY KEY, ros_distro TEXT NOT NULL);
CREATE TABLE metadata(id INTEGER PRIMARY KEY, metadata_version INTEGER NOT NULL,
    metadata TEXT NOT NULL);
CREATE TABLE topics(id INTEGER PRIMARY KEY, name TEXT NOT NULL, type TEXT NOT NULL,
    serialization_format TEXT NOT NULL, offered_qos_profiles TEXT NOT NULL);
CREATE TABLE messages(id INTEGER PRIMARY KEY, topic_id INTEGER NOT NULL,
    timestamp INTEGER NOT NULL, data BLOB NOT NULL);
CREATE INDEX timestamp_idx ON messages (timestamp ASC);
INSERT INTO schema VALUES (3, 'humble');
"""

QOS = """- history: 3
  depth: 0
  reliability: 2
  durability: 2
  deadline:
    sec: 9223372036
    nsec: 854775807
  lifespan:
    sec: 9223372036
    nsec: 854775807
  liveliness: 1
  liveliness_lease_duration:
    sec: 9223372036
    nsec: 854775807
  avoid_ros_namespace_conventions: false"""

TYPES = {POINTS: "sensor_msgs/msg/PointCloud2", "/driver": "std_msgs/msg/String"}

# What metadata.yaml has to have for ROS 2 to play the bag.
KEYS = {
    *("version", "storage_identifier", "duration", "starting_time", "message_count"),
    *("topics_with_message_count", "compression_format", "compression_mode"),
    *("relative_file_paths", "files"),
}
TOPIC_KEYS = {"name", "type", "serialization_format", "offered_qos_profiles"}


def make_bag(folder, scans):
    """A bag of clouds and texts."""
    folder.mkdir(parents=True)
    write_cloud = serialize_dynamic(TYPES[POINTS], CLOUD)[TYPES[POINTS]]
    write_text = serialize_dynamic(TYPES["/driver"], "string data\n")[TYPES["/driver"]]
    with sqlite3.connect(folder / f"{folder.name}_0.db3") as database:
        database.executescript(TABLES)
        for number, (name, type_) in enumerate(TYPES.items(), 1):
            row = number, name, type_, "cdr", QOS
            database.execute("INSERT INTO topics VALUES (?, ?, ?, ?, ?)", row)
        for number, scan in enumerate(scans):
            time = START + number * PERIOD
            messages = {2: write_text({"data": f"cloud {number} ✓"})}
            messages[1] = write_cloud(cloud_of(scan, time - 9000))
            for topic, data in messages.items():
                row = topic, time, bytes(data)
                database.execute(
                    "INSERT INTO messages (topic_id, timestamp, data) VALUES (?, ?, ?)", row
                )
    times = {
        "duration": {"nanoseconds": (len(scans) - 1) * PERIOD},
        "starting_time": {"nanoseconds_since_epoch": START},
        "message_count": 2 * len(scans),
    }
    topics = [
        {
            "topic_metadata": {
                "name": name,
                "type": type_,
                "serialization_format": "cdr",
                "offered_qos_profiles": QOS,
            },
            "message_count": len(scans),
        }
        for name, type_ in TYPES.items()
    ]
    content = {"version": 5, "storage_identifier": "sqlite3", **times}
    content |= {"topics_with_message_count": topics, "compression_format": ""}
    content |= {"compression_mode": "", "relative_file_paths": [f"{folder.name}_0.db3"]}
    content["files"] = [{"path": f"{folder.name}_0.db3", **times}]
    (folder / "metadata.yaml").write_text(yaml.safe_dump({"rosbag2_bagfile_information": content}))


def compare_bags(before, after, masks):
    """Compares message by message."""
    old, new = messages(before), messages(after)
    return {
        **messages_that_stay(old, new, ("topics and times", 2)),
        "types, encodings and quality of service": topics_of(before) == topics_of(after),
        **points_that_stay(clouds(old), clouds(new), masks),
        "metadata.yaml is complete, and right": metadata_is_right(after, new),
    }


def metadata(folder):
    """The content of the metadata.yaml."""
    return yaml.safe_load((folder / "metadata.yaml").read_text())["rosbag2_bagfile_information"]


def rows(folder, query):
    """The rows that a query finds in its databases."""
    found = []
    for name in metadata(folder)["relative_file_paths"]:
        database = sqlite3.connect(f"file:{folder / name}?mode=ro", uri=True)
        assert database.execute("PRAGMA integrity_check").fetchall() == [("ok",)]
        found += database.execute(query).fetchall()
        database.close()
    return found


def messages(folder):
    """Topic, time and bytes of all messages, in the order of ROS 2."""
    return rows(
        folder,
        "SELECT name, timestamp, data FROM messages JOIN topics ON topic_id = topics.id "
        "ORDER BY timestamp, messages.id",
    )


def topics_of(folder):
    """Topics in the databases and metadata.yaml, quality of service as values."""
    query = "SELECT name, type, serialization_format, offered_qos_profiles FROM topics"
    in_database = [(*row[:3], yaml.safe_load(row[3])) for row in rows(folder, query)]
    in_file = []
    for topic in metadata(folder)["topics_with_message_count"]:
        described = topic["topic_metadata"]
        profiles = yaml.safe_load(described["offered_qos_profiles"])
        names = [described[key] for key in ("name", "type", "serialization_format")]
        in_file.append((*names, profiles))
    return sorted(in_database, key=str), sorted(in_file, key=str)


def clouds(found):
    """The points of all clouds, as mcap_ros2 reads them."""
    read = generate_dynamic(TYPES[POINTS], CLOUD)[TYPES[POINTS]]
    return [
        np.frombuffer(read(data).data, "<f4").reshape(-1, 4)
        for name, _, data in found
        if name == POINTS
    ]


def metadata_is_right(folder, found):
    """True if the metadata.yaml has all that ROS 2 requires, and agrees with the database."""
    content, times = metadata(folder), [time for _, time, _ in found]
    assert content.keys() >= KEYS, KEYS - content.keys()
    counts = {}
    for topic in content["topics_with_message_count"]:
        assert topic["topic_metadata"].keys() >= TOPIC_KEYS
        counts[topic["topic_metadata"]["name"]] = topic["message_count"]
    return (
        content["storage_identifier"] == "sqlite3"
        and content["message_count"] == len(found) == sum(counts.values())
        and all(n == sum(name == m[0] for m in found) for name, n in counts.items())
        and content["starting_time"]["nanoseconds_since_epoch"] == min(times)
        and content["duration"]["nanoseconds"] == max(times) - min(times)
        and [file["path"] for file in content["files"]] == content["relative_file_paths"]
    )


if __name__ == "__main__":
    sys.exit(make_or_compare(__doc__, make_bag, compare_bags))
