"""Messages of clouds, beside those that the library of bags writes."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from benchmarks.recorded_bags import CLOUD_TYPE, START, Ros, table_of
from derain.bags.cloud_message import CDR, ROS1, CloudMessage, stamp_of

ROS = {ROS1: Ros("ros1"), CDR: Ros("mcap")}


def made_by_library(encoding: str, points: int = 5, frame: str = "velodyne") -> bytes:
    """A message of the library, of a cloud with padding within and after its fields."""
    table = np.zeros(
        points,
        np.dtype(
            {
                "names": ["x", "y", "z", "intensity", "ring", "time"],
                "formats": ["<f4", "<f4", "<f4", "<f4", "<u2", "<f8"],
                "offsets": [0, 4, 8, 16, 20, 24],
                "itemsize": 37,
            }
        ),
    )
    table["x"], table["ring"] = np.arange(points), np.arange(points)[::-1]
    ros = ROS[encoding]
    cloud = ros.cloud(table, START)
    cloud.header.frame_id = frame
    return ros.to_bytes(cloud, CLOUD_TYPE)


@pytest.mark.parametrize("encoding", [ROS1, CDR])
@pytest.mark.parametrize("frame", ["", "a", "ab", "lidar_é"])
def test_a_message_of_the_library_is_read_and_written_alike(encoding, frame) -> None:
    message = made_by_library(encoding, frame=frame)
    parsed = CloudMessage.parse(message, encoding)

    assert parsed.to_bytes() == message
    assert parsed.stamp == stamp_of(message, encoding) == START
    columns = parsed.cloud.columns()
    assert list(columns) == ["x", "y", "z", "intensity", "ring", "time"]
    assert columns["ring"].tolist() == [4, 3, 2, 1, 0]


@pytest.mark.parametrize("encoding", [ROS1, CDR])
def test_the_library_reads_what_is_left_of_a_message(encoding) -> None:
    parsed = CloudMessage.parse(made_by_library(encoding), encoding)
    keep = np.array([True, False, True, True, False])
    cloud = parsed.cloud.take(keep).with_field("probability", np.float32([0.1, 0.2, 0.3]))
    store = ROS[encoding].store
    read = store.deserialize_ros1 if encoding == ROS1 else store.deserialize_cdr
    message = read(replace(parsed, cloud=cloud).to_bytes(), CLOUD_TYPE)

    assert (message.height, message.width, message.point_step) == (1, 3, 41)
    assert [field.name for field in message.fields][-1] == "probability"
    table = np.frombuffer(
        message.data,
        np.dtype(
            {"names": ["x", "p"], "formats": ["<f4", "<f4"], "offsets": [0, 37], "itemsize": 41}
        ),
    )
    assert table["x"].tolist() == [0, 2, 3]
    np.testing.assert_array_equal(table["p"], np.float32([0.1, 0.2, 0.3]))


def test_big_endian_points_are_read_and_written_alike() -> None:
    cloud = ROS[CDR].cloud(table_of({axis: np.arange(3, dtype=">f4") for axis in "xyz"}), START)
    message = ROS[CDR].to_bytes(cloud, CLOUD_TYPE)
    parsed = CloudMessage.parse(message, CDR)
    assert parsed.cloud.is_bigendian
    assert parsed.cloud.columns()["x"].tolist() == [0, 1, 2]
    assert parsed.to_bytes() == message


@pytest.mark.parametrize("encoding", [ROS1, CDR])
def test_a_message_that_is_cut_off_or_of_another_kind_is_refused(encoding) -> None:
    message = made_by_library(encoding)
    for end in range(len(message)):
        with pytest.raises(ValueError, match=r"ends too early|plain CDR|PointCloud2|Invalid"):
            CloudMessage.parse(message[:end], encoding)
    with pytest.raises(ValueError, match="plain CDR"):
        CloudMessage.parse(b"\x00\x00\x00\x00" + made_by_library(CDR)[4:], CDR)


@pytest.mark.parametrize("encoding", [ROS1, CDR])
def test_bytes_behind_a_message_are_refused_and_padding_is_not(encoding) -> None:
    message = made_by_library(encoding)
    with pytest.raises(ValueError, match="PointCloud2"):
        CloudMessage.parse(message + bytes(4), encoding)
    if encoding == CDR:  # DDS pads to a multiple of four bytes
        assert CloudMessage.parse(message + bytes(3), CDR).to_bytes() == message


@pytest.mark.parametrize("encoding", [ROS1, CDR])
def test_a_name_that_is_not_utf_8_is_refused(encoding) -> None:
    message = made_by_library(encoding).replace(b"intensity", b"intensit\xe9")
    with pytest.raises(ValueError, match="utf-8"):
        CloudMessage.parse(message, encoding)


@given(st.data(), st.sampled_from([ROS1, CDR]))
def test_a_damaged_message_is_read_or_refused(data, encoding) -> None:
    message = bytearray(made_by_library(encoding))
    for _ in range(data.draw(st.integers(1, 4))):
        place = data.draw(st.integers(0, len(message) - 1))
        message[place] = data.draw(st.integers(0, 255))
    try:
        parsed = CloudMessage.parse(bytes(message), encoding)
    except ValueError:
        return
    parsed.cloud.columns()
    parsed.cloud.take(np.zeros(len(parsed.cloud), bool)).columns()
