"""Bags in MCAP, made and read by the libraries of MCAP's makers: nothing here is derain's.

python -m venv others && others/bin/pip install mcap mcap-ros2-support numpy
P="others/bin/python benchmarks/by_others/foxglove.py"
$P make bags ../shared/data/wads/drive/velodyne --scans 5
derain run ../shared/data/wads/drive/velodyne/*00?.bin --out masks
for kind in none lz4 zstd unchunked; do
    derain run bags/$kind.mcap --out cleaned
    $P compare bags/$kind.mcap cleaned/$kind.mcap masks
done

Ends with 1 where anything is not the same.
"""

import io
import sys
from zlib import crc32

import numpy as np
from comparison import (
    PERIOD,
    POINTS,
    START,
    make_or_compare,
    messages_that_stay,
    points_that_stay,
)
from mcap.reader import NonSeekingReader, SeekingReader, make_reader
from mcap.writer import CompressionType
from mcap.writer import Writer as McapWriter
from mcap_ros2.decoder import DecoderFactory
from mcap_ros2.writer import Writer

TIME = "int32 sec\nuint32 nanosec\n"
HEADER = "builtin_interfaces/Time stamp\nstring frame_id\n"
FIELD = "string name\nuint32 offset\nuint8 datatype\nuint32 count\n"
SEPARATOR = "=" * 80
CLOUD = f"""std_msgs/Header header
uint32 height
uint32 width
sensor_msgs/PointField[] fields
bool is_bigendian
uint32 point_step
uint32 row_step
uint8[] data
bool is_dense
{SEPARATOR}
MSG: std_msgs/Header
{HEADER}{SEPARATOR}
MSG: builtin_interfaces/Time
{TIME}{SEPARATOR}
MSG: sensor_msgs/PointField
{FIELD}"""

KINDS = {
    "none": {"compression": CompressionType.NONE},
    "lz4": {"compression": CompressionType.LZ4},
    "zstd": {"compression": CompressionType.ZSTD},
    "unchunked": {"use_chunking": False},
}


def make_files(folder, scans):
    """A file of each kind."""
    folder.mkdir(parents=True, exist_ok=True)
    for kind, options in KINDS.items():
        make_file(folder / f"{kind}.mcap", options, scans)


def make_file(path, options, scans):
    """A file with attachments, metadata, and times of publication before those of recording."""
    with path.open("wb") as file:
        writer = Writer(io.BytesIO())  # which does not have all the options
        writer._writer = McapWriter(file, chunk_size=300_000, **options)
        writer._writer.start("ros2", "made by others")
        writer._writer.add_metadata("trip", {"vehicle": "red", "driver": "nobody"})
        cloud = writer.register_msgdef("sensor_msgs/msg/PointCloud2", CLOUD)
        text = writer.register_msgdef("std_msgs/msg/String", "string data\n")
        for number, scan in enumerate(scans):
            time = START + number * PERIOD
            content = {"data": f"cloud {number} ✓"}
            writer.write_message("/driver", text, content, time, time - 500, 10 + number)
            message = cloud_of(scan, time - 9000)
            writer.write_message(POINTS, cloud, message, time, time - 1000, 20 + number)
        picture = bytes(range(256)) * 100
        writer._writer.add_attachment(START, START + 1, "camera.jpg", "image/jpeg", picture)
        writer.finish()


def cloud_of(scan, time):
    """A cloud in the form of mcap_ros2."""
    points = np.fromfile(scan, "<f4").reshape(-1, 4)
    fields = [
        {"name": name, "offset": 4 * place, "datatype": 7, "count": 1}
        for place, name in enumerate(("x", "y", "z", "intensity"))
    ]
    stamp = {"sec": time // 10**9, "nanosec": time % 10**9}
    return {
        "header": {"stamp": stamp, "frame_id": "velodyne"},
        "height": 1,
        "width": len(points),
        "fields": fields,
        "is_bigendian": False,
        "point_step": 16,
        "row_step": 16 * len(points),
        "data": points.tobytes(),
        "is_dense": True,
    }


def compare_files(before, after, masks):
    """Compares message by message."""
    head = "topics, numbers, times of recording and publication", 4
    return {
        **messages_that_stay(messages(before), messages(after), head),
        "schemas, encodings and notes of channels": described(before) == described(after),
        "attachments and metadata": attached(before) == attached(after),
        **points_that_stay(clouds(before), clouds(after), masks),
        "checksums, summary and index": is_sound(after),
    }


def messages(path):
    """Topic, number, times and bytes of all messages, in the order of time."""
    with path.open("rb") as file:
        return [
            (channel.topic, each.sequence, each.log_time, each.publish_time, each.data)
            for _, channel, each in make_reader(file, validate_crcs=True).iter_messages()
        ]


def clouds(path):
    """The points of all clouds, as mcap_ros2 reads them."""
    with path.open("rb") as file:
        reader = make_reader(file, decoder_factories=[DecoderFactory()])
        return [
            np.frombuffer(each.decoded_message.data, "<f4").reshape(-1, 4)
            for each in reader.iter_decoded_messages([POINTS])
        ]


def described(path):
    """The channels of a file."""
    with path.open("rb") as file:
        return {
            (
                *(channel.topic, channel.message_encoding, tuple(channel.metadata.items())),
                *(schema.name, schema.encoding, schema.data),
            )
            for schema, channel, _ in make_reader(file).iter_messages()
        }


def attached(path):
    """Attachments, and metadata but ROS 2's own."""
    with path.open("rb") as file:
        attachments = list(NonSeekingReader(file).iter_attachments())
    with path.open("rb") as file:
        metadata = list(NonSeekingReader(file).iter_metadata())
    return attachments, [each for each in metadata if each.name != "rosbag2"]


def is_sound(path):
    """True if every checksum, number and place in a file is right."""
    with path.open("rb") as file:
        one_by_one = list(NonSeekingReader(file, validate_crcs=True).iter_messages())
    with path.open("rb") as file:
        reader = SeekingReader(file, validate_crcs=True)
        summary = reader.get_summary()
        statistics = summary.statistics
        assert len(list(reader.iter_messages())) == len(one_by_one) == statistics.message_count
        assert statistics.chunk_count == len(summary.chunk_indexes)
        assert statistics.attachment_count == len(summary.attachment_indexes)
        assert statistics.metadata_count == len(summary.metadata_indexes)
        assert len(list(reader.iter_attachments())) == statistics.attachment_count
        assert len(list(reader.iter_metadata())) == statistics.metadata_count
    content = path.read_bytes()
    start = int.from_bytes(content[-28:-20], "little")
    return crc32(content[start:-12]) == int.from_bytes(content[-12:-8], "little")


if __name__ == "__main__":
    sys.exit(make_or_compare(__doc__, make_files, compare_files))
