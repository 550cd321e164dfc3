"""Messages and a node with as much of ROS 2 in them as the example asks for."""

import array
from dataclasses import dataclass, field
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from derain.scan import Float32s

EXAMPLE = Path(__file__).resolve().parents[2] / "examples" / "ros2_node"

# x, y, z, 4 bytes of nothing, intensity, ring, and a byte more.
POINT = np.dtype(
    [(name, "<f4") for name in "xyz"]
    + [("", "V4"), ("intensity", "<f4"), ("ring", "<u2"), ("", "V1")]
)
FLOAT32, UINT16 = 7, 4


@dataclass
class Field:
    """As rclpy makes it."""

    name: str = ""
    offset: int = 0
    datatype: int = 0
    count: int = 0


@dataclass
class PointCloud2:
    """As rclpy makes it: every attribute has its default, and data is an array of bytes."""

    header: Any = None
    height: int = 0
    width: int = 0
    fields: list[Field] = field(default_factory=list)
    is_bigendian: bool = False
    point_step: int = 0
    row_step: int = 0
    data: Any = field(default_factory=lambda: array.array("B"))
    is_dense: bool = False


@dataclass
class KeyValue:
    """As rclpy makes it."""

    key: str = ""
    value: str = ""


@dataclass
class DiagnosticStatus:
    """As rclpy makes it."""

    OK = b"\0"
    WARN = b"\1"
    ERROR = b"\2"
    level: bytes = OK
    name: str = ""
    message: str = ""
    hardware_id: str = ""
    values: list[KeyValue] = field(default_factory=list)


@dataclass
class DiagnosticArray:
    """As rclpy makes it."""

    header: Any = field(default_factory=SimpleNamespace)
    status: list[DiagnosticStatus] = field(default_factory=list)


class Publisher(list[Any]):
    """What was published."""

    publish = list.append


class Logger(list[str]):
    """What was logged."""

    def error(self, text: str, throttle_duration_sec: float) -> None:
        self.append(text)

    warning = fatal = list.append


class Node:
    """What the example asks of a node of rclpy."""

    def __init__(self, **parameters: Any) -> None:
        self.parameters = parameters
        self.publishers: dict[str, tuple[type, Publisher, Any]] = {}
        self.subscriptions: dict[str, tuple[type, Any, Any]] = {}
        self.timers: list[tuple[float, Any]] = []
        self.logger = Logger()
        self.destroyed = False

    def declare_parameter(self, name: str, default: Any) -> SimpleNamespace:
        return SimpleNamespace(value=self.parameters.get(name, default))

    def create_publisher(self, kind: type, topic: str, quality: Any) -> Publisher:
        self.publishers[topic] = (kind, Publisher(), quality)
        return self.publishers[topic][1]

    def create_subscription(self, kind: type, topic: str, call: Any, quality: Any) -> None:
        self.subscriptions[topic] = (kind, call, quality)

    def create_timer(self, period: float, call: Any) -> None:
        self.timers.append((period, call))

    def get_logger(self) -> Logger:
        return self.logger

    def destroy_node(self) -> None:
        self.destroyed = True

    def get_name(self) -> str:
        return "derain"

    def get_clock(self) -> SimpleNamespace:
        now = SimpleNamespace(to_msg=lambda: "the time")
        return SimpleNamespace(now=lambda: now)


def message_of(points: Float32s, height: int = 1, gap: int = 0) -> PointCloud2:
    """A message of (N, 4) points in rows, each followed by a gap of so many bytes."""
    table = np.frombuffer(np.random.default_rng(0).bytes(len(points) * 23), POINT).copy()
    names = ("x", "y", "z", "intensity")
    for place, name in enumerate(names):
        table[name] = points[:, place]
    width = len(points) // height
    rows = np.frombuffer(table.tobytes(), np.uint8).reshape(height, width * 23)
    rows = np.pad(rows, ((0, 0), (0, gap)), constant_values=7)
    fields = [Field(name, POINT.fields[name][1], FLOAT32, 1) for name in names]
    return PointCloud2(
        SimpleNamespace(stamp="now", frame_id="lidar"),
        height,
        width,
        [*fields, Field("ring", 20, UINT16, 1)],
        point_step=23,
        row_step=width * 23 + gap,
        data=array.array("B", rows.tobytes()),
        is_dense=True,
    )


@dataclass
class Ros:
    """What the example asks of rclpy itself, where some messages come in before it ends."""

    node: Node
    messages: list[PointCloud2]
    ending: BaseException | None = None
    running: bool = False

    def init(self) -> None:
        self.running = True

    def create_node(self, name: str) -> Node:
        assert self.running
        assert name == "derain"
        return self.node

    def spin(self, node: Node) -> None:
        ((_, call, _),) = node.subscriptions.values()
        for message in self.messages:
            call(message)
        for _, report in node.timers:
            report()
        if self.ending is not None:
            raise self.ending

    def ok(self) -> bool:
        return self.running

    def try_shutdown(self) -> None:
        self.running = False


class ExternalShutdownError(Exception):
    """As rclpy raises it where something else than the node ends it."""
