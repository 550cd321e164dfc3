"""The bytes of a ``sensor_msgs/PointCloud2`` message, as ROS 1 and ROS 2 write them.

The library of bags reads and writes them by its own definition of the type, which bags of older
ROS 2 do not hold. A message whose cloud does not change is written back byte for byte, except for
up to three bytes that DDS may append so that its length is a multiple of four.

Numbers of a message are little-endian, whatever the order of the bytes of its points.

Source: of the encapsulation of ROS 2, CDR of DDSI-RTPS 2.5, 10.2.
"""

import struct
from dataclasses import dataclass, replace
from functools import cache
from typing import Any, Self

import numpy as np

from derain.bags.point_cloud import PointCloud
from derain.bags.topics import POINT_CLOUD
from derain.system.extras import ROSBAGS

# What an encapsulation begins with: plain CDR in little-endian byte order; and its size.
PLAIN_CDR, CDR_HEADER = b"\x00\x01", 4

# How messages of ROS 1 and ROS 2 are written.
ROS1, CDR = "ros1", "cdr"

# In ROS 1 a header begins with a counter of messages, in ROS 2 with the stamp.
STAMP_AT = {ROS1: 4, CDR: CDR_HEADER}

# The name of the type of its fields, beside POINT_CLOUD.
POINT_FIELD = "sensor_msgs/msg/PointField"


@dataclass(frozen=True, eq=False)
class CloudMessage:
    """A PointCloud2 message.

    Attributes:
        encoding: ``ros1`` or ``cdr``.
        content: The message, as the library has it.
        cloud: The cloud.
        stamp: Time of the cloud, nanoseconds; 0 where the driver writes none.
    """

    encoding: str
    content: Any
    cloud: PointCloud
    stamp: int

    @classmethod
    def parse(cls, message: bytes, encoding: str) -> Self:
        """Reads a message.

        Args:
            message: Its bytes.
            encoding: ``ros1`` or ``cdr``.

        Raises:
            ValueError: Bytes that are no PointCloud2, or one that contradicts itself.
        """
        stamp = stamp_of(message, encoding)
        store = _store(encoding)
        read = store.deserialize_ros1 if encoding == ROS1 else store.deserialize_cdr
        try:
            content = read(memoryview(message), POINT_CLOUD)
        except ROSBAGS.load("bags", "serde").SerdeError as error:
            raise ValueError(str(error)) from error
        return cls(encoding, content, PointCloud.of(content), stamp)

    def to_bytes(self) -> bytes:
        """The bytes of the message."""
        cloud, store = self.cloud, _store(self.encoding)
        field = store.types[POINT_FIELD]
        content = replace(
            self.content,
            height=cloud.height,
            width=cloud.width,
            fields=[field(f.name, f.offset, f.datatype, f.count) for f in cloud.fields],
            is_bigendian=cloud.is_bigendian,
            point_step=cloud.point_step,
            row_step=cloud.row_step,
            data=np.frombuffer(cloud.data, np.uint8),
            is_dense=cloud.is_dense,
        )
        write = store.serialize_ros1 if self.encoding == ROS1 else store.serialize_cdr
        return bytes(write(content, POINT_CLOUD))


@cache
def _store(encoding: str) -> Any:
    """The types of ROS 1 or ROS 2 as the library knows them."""
    types = ROSBAGS.load("bags", "typesys")
    return types.get_typestore(
        types.Stores.ROS1_NOETIC if encoding == ROS1 else types.Stores.ROS2_HUMBLE
    )


def stamp_of(message: bytes, encoding: str) -> int:
    """Time at which the cloud of a message was taken, nanoseconds, without reading the cloud.

    Args:
        message: The bytes of a message that begins with a header.
        encoding: ``ros1`` or ``cdr``.

    Raises:
        ValueError: Bytes that are no such message.
    """
    if encoding == CDR and message[:2] != PLAIN_CDR:
        raise ValueError(f"it begins with {bytes(message[:4]).hex()}, which is not plain CDR")
    start = STAMP_AT[encoding]
    if len(message) < start + 8:
        raise ValueError("the message ends too early")
    kinds = "<iI" if encoding == CDR else "<II"  # seconds are signed in ROS 2
    seconds, nanoseconds = struct.unpack_from(kinds, message, start)
    return int(seconds) * 10**9 + int(nanoseconds)
