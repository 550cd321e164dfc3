"""The bytes of a ``sensor_msgs/PointCloud2`` message, as ROS 1 and ROS 2 write them.

The bytes before and after the cloud are kept, so a message whose cloud does not change is written
back byte for byte. The library that reads bags is not used here: it needs the definitions of types,
which bags of older ROS 2 do not hold.

Numbers of a message are little-endian, whatever the order of the bytes of its points.

Source: of ROS 1, http://wiki.ros.org/msg ("Fields", nothing aligned). Of ROS 2, CDR of DDSI-RTPS
2.5, 10.2 (encapsulation) and CORBA 3.3 part 2, 9.3 (alignment from the end of the encapsulation
header).
"""

import struct
from dataclasses import dataclass
from typing import Self

from derain.bags.point_cloud import PointCloud, PointField

# What an encapsulation begins with: plain CDR in little-endian byte order; and its size.
PLAIN_CDR, CDR_HEADER = b"\x00\x01", 4

# How messages of ROS 1 and ROS 2 are written.
ROS1, CDR = "ros1", "cdr"

# In ROS 1 a header begins with a counter of messages, in ROS 2 with the stamp.
STAMP_AT = {ROS1: 4, CDR: CDR_HEADER}

# Strings of ROS may be any bytes.
TEXT = ("utf-8", "surrogateescape")


@dataclass(frozen=True, eq=False)
class CloudMessage:
    """A PointCloud2 message.

    Attributes:
        encoding: ``ros1`` or ``cdr``.
        head: Its bytes up to the cloud: the header with stamp and frame.
        cloud: The cloud.
        tail: Its bytes after the cloud.
        stamp: Time of the cloud, nanoseconds; 0 where the driver writes none.
    """

    encoding: str
    head: bytes
    cloud: PointCloud
    tail: bytes
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
        read = _Reader(message, encoding)
        read.take(STAMP_AT[encoding] - read.position + 8)  # the stamp
        read.string()  # the frame
        head = message[: read.position]
        height, width, count = read.numbers("III")
        fields = tuple(PointField(read.string(), *read.numbers("IBI")) for _ in range(count))
        bigendian, point_step, row_step, size = read.numbers("BIII")
        data = read.take(size)
        (dense,) = read.numbers("B")
        cloud = PointCloud(
            height, width, fields, bool(bigendian), point_step, row_step, data, bool(dense)
        )
        tail = message[read.position :]
        return cls(encoding, head, cloud, tail, stamp)

    def to_bytes(self) -> bytes:
        """The bytes of the message."""
        cloud, write = self.cloud, _Writer(self.head, self.encoding)
        write.numbers("III", cloud.height, cloud.width, len(cloud.fields))
        for field in cloud.fields:
            write.string(field.name)
            write.numbers("IBI", field.offset, field.datatype, field.count)
        write.numbers("BIII", cloud.is_bigendian, cloud.point_step, cloud.row_step, len(cloud.data))
        write.message += cloud.data
        write.numbers("B", cloud.is_dense)
        write.message += self.tail
        return bytes(write.message)


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


def _aligned(position: int, size: int, encoding: str) -> int:
    """The next position at which a number of `size` bytes may begin."""
    return position if encoding == ROS1 else position + (CDR_HEADER - position) % size


class _Reader:
    """Reads the values of a message one after the other."""

    def __init__(self, message: bytes, encoding: str) -> None:
        self.message = memoryview(message)
        self.encoding = encoding
        self.position = 0

    def numbers(self, kinds: str) -> list[int]:
        values: list[int] = []
        for kind in kinds:
            layout = struct.Struct("<" + kind)
            self.position = _aligned(self.position, layout.size, self.encoding)
            values += layout.unpack(self.take(layout.size))
        return values

    def string(self) -> str:
        (size,) = self.numbers("I")
        text = bytes(self.take(size))
        if self.encoding == CDR and text:
            if text[-1]:
                raise ValueError("a text in it does not end as CDR requires")
            text = text[:-1]
        return text.decode(*TEXT)

    def take(self, size: int) -> memoryview:
        start, self.position = self.position, self.position + size
        if self.position > len(self.message):
            raise ValueError("the message ends too early")
        return self.message[start : self.position]


class _Writer:
    """Appends values to the bytes of a message."""

    def __init__(self, head: bytes, encoding: str) -> None:
        self.message = bytearray(head)
        self.encoding = encoding

    def numbers(self, kinds: str, *values: int) -> None:
        for kind, value in zip(kinds, values, strict=True):
            layout = struct.Struct("<" + kind)
            place = _aligned(len(self.message), layout.size, self.encoding)
            self.message += bytes(place - len(self.message)) + layout.pack(value)

    def string(self, text: str) -> None:
        content = text.encode(*TEXT) + (b"\0" if self.encoding == CDR else b"")
        self.numbers("I", len(content))
        self.message += content
