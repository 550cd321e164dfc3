"""Messages and a node with as much of ROS 2 in them as the example asks for."""

import array
from dataclasses import dataclass, field
from types import SimpleNamespace
from typing import Any


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

    warning = list.append


class Node:
    """What the example asks of a node of rclpy."""

    def __init__(self, **parameters: Any) -> None:
        self.parameters = parameters
        self.publishers: dict[str, tuple[type, Publisher, Any]] = {}
        self.subscriptions: dict[str, tuple[type, Any, Any]] = {}
        self.timers: list[tuple[float, Any]] = []
        self.logger = Logger()

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

    def get_name(self) -> str:
        return "derain"

    def get_clock(self) -> SimpleNamespace:
        now = SimpleNamespace(to_msg=lambda: "the time")
        return SimpleNamespace(now=lambda: now)
