"""A node of ROS 2 that takes the rain out of a topic of point clouds.

It needs ROS 2 with Python 3.11 or later (Jazzy has 3.12), and derain, installed without extras::

    python3 derain_node.py --ros-args -p input:=/ouster/points -p output:=/ouster/points/clean

``derain.launch.py`` beside it starts it with parameters; ``docs/robot.md`` describes the
installation.

Parameters:

- ``input``, ``output``: topics of ``sensor_msgs/PointCloud2`` (``points``, ``points/clean``).
- ``removed``: topic for the removed points; empty, the default, for none.
- ``model``: an ONNX file of ``derain export``; empty for the model that comes with derain.
- ``dry``: a dry scan of the same sensor in the same kind of place, as a file; with it the level
  shows fog that returns nothing too. Empty, as it is by default, for none.
- ``threads``: threads for each cloud; 0 takes every core.
- ``queue``: how many clouds may wait while one is cleaned (1). Where clouds come faster than they
  are cleaned, older ones are let go of: the next to be cleaned is the newest that there is.
- ``organised``: keep rows and columns of a cloud, with NaN where rain was (false).

Stamp, frame, order of the points and all of their fields stay as they are. A cloud is published
whole where more than 35 % of its valid points are called rain: no rain is that heavy, and a robot
must not lose what it could run into. Once a second ``/diagnostics`` has what share of the valid
points was called rain, how far one sees, and how long a cloud took; its level is a warning or an
error where visibility is low, by the levels of ``derain.Alarm``.
"""

import array
import sys
from dataclasses import dataclass, field
from pathlib import Path
from time import perf_counter
from typing import Any

import numpy as np
from numpy.typing import NDArray

from derain.bags.point_cloud import PointCloud, scan_of_cloud
from derain.errors import InputError
from derain.export.runtime import Derainer, Judgement
from derain.files import read_scan
from derain.system.memory import keep_freed_memory
from derain.views.scan_issues import MOST_RAIN
from derain.weather.alarm import ERROR, Alarm, Level
from derain.weather.scan_weather import ScanWeather
from derain.weather.visibility import Visibility

DEFAULTS = {
    "input": "points",
    "output": "points/clean",
    "removed": "",
    "model": "",
    "dry": "",
    "threads": 0,
    "queue": 1,
    "organised": False,
}

# Seconds from one diagnostic to the next, as ROS's own drivers have it.
DIAGNOSTIC_PERIOD = 1.0


def message_of(cloud: PointCloud, like: Any) -> Any:
    """A PointCloud2 of some of the points of another, with its header and its fields."""
    message = type(like)()
    message.header, message.fields = like.header, like.fields
    message.is_bigendian, message.point_step = like.is_bigendian, like.point_step
    message.height, message.width, message.row_step = cloud.height, cloud.width, cloud.row_step
    # rclpy takes an array of bytes as it is, and looks at every byte of anything else.
    message.data = array.array("B")
    message.data.frombytes(cloud.data)
    message.is_dense = cloud.is_dense
    return message


def cleaned(message: Any, rain: NDArray[np.bool_], organised: bool = False) -> Any:
    """A PointCloud2 without its rain, bool (N,); organised, with NaN in its place.

    Raises:
        ValueError: Coordinates that can hold no NaN.
    """
    cloud = PointCloud.of(message)
    return message_of(cloud.blank(rain) if organised else cloud.take(~rain), message)


def removed(message: Any, rain: NDArray[np.bool_]) -> Any:
    """A PointCloud2 of the rain alone."""
    return message_of(PointCloud.of(message).take(rain), message)


def rain_to_remove(judgement: Judgement) -> NDArray[np.bool_]:
    """The rain of a cloud, bool (N,): none where more is called rain than any rain has."""
    return judgement.rain & (judgement.share_of_rain <= MOST_RAIN)


@dataclass
class Tally:
    """Counts of the clouds since the last diagnostic.

    Attributes:
        clouds: How many were cleaned.
        points: Their points.
        valid: Those of them that can be judged.
        rain: Those of these that were called rain.
        seconds: What cleaning them took.
        weather: What they show of the weather, all together.
        level: How bad it is, after the last of them.
    """

    clouds: int = 0
    points: int = 0
    valid: int = 0
    rain: int = 0
    seconds: float = 0.0
    weather: ScanWeather = field(default_factory=ScanWeather.none)
    level: Level = Level.CLEAR

    def add(self, judgement: Judgement, seconds: float, alarm: Alarm) -> None:
        """Counts a cloud, and updates the alarm with its weather."""
        weather = judgement.weather
        self.weather += weather
        self.level = alarm.update(weather.visibility, weather.reach)
        self.clouds += 1
        self.points += len(judgement.rain)
        self.valid += int(judgement.scan.valid.sum())
        self.rain += int(judgement.rain.sum())
        self.seconds += seconds

    @property
    def share(self) -> float:
        """Share of the valid points that was called rain; 0 of no points."""
        return self.rain / max(self.valid, 1)

    @property
    def warning(self) -> str:
        """The text of a warning; empty if there is none."""
        if not self.clouds:
            return "no clouds"
        if self.share > MOST_RAIN:
            return "more taken for rain than any rain has: is it the right unit and sensor?"
        return ""

    def values(self) -> dict[str, str]:
        """The values of a diagnostic, by name."""
        return {
            "clouds": str(self.clouds),
            "points per cloud": f"{self.points / max(self.clouds, 1):.0f}",
            "share of rain": f"{self.share:.4f}",
            "visibility": str(self.weather.visibility),
            "reach": str(self.weather.reach),
            "milliseconds per cloud": f"{1000 * self.seconds / max(self.clouds, 1):.1f}",
        }


@dataclass
class RainRemover:
    """Judges clouds, counts the outcomes, and keeps the warnings that it has given."""

    derainer: Derainer
    tally: Tally = field(default_factory=Tally)
    logged: set[str] = field(default_factory=set)
    alarm: Alarm = field(default_factory=Alarm)

    def judge(self, message: Any) -> Judgement:
        """Returns the rain of a PointCloud2, row after row.

        Raises:
            InputError: A cloud without x, y and z, or scores that are not finite.
            ValueError: A message that contradicts itself.
        """
        began = perf_counter()
        judgement = self.derainer.judge(scan_of_cloud(Path("cloud"), PointCloud.of(message)))
        self.tally.add(judgement, perf_counter() - began, self.alarm)
        return judgement

    def news(self, judgement: Judgement) -> list[str]:
        """New kinds of warnings about a cloud."""
        odd = [one for one in self.derainer.issues(judgement) if one.kind not in self.logged]
        self.logged |= {one.kind for one in odd}
        return [one.detail for one in odd]

    def tally_so_far(self) -> Tally:
        """The counts of the clouds since the last call."""
        tally, self.tally = self.tally, Tally()
        return tally


def refuse(asked: dict[str, Any]) -> None:
    """Refuses parameters that no node can run with.

    Raises:
        InputError: A topic that is named twice, or a queue that holds no cloud.
    """
    named: dict[str, str] = {}
    for name in ("input", "output", "removed"):
        first = named.setdefault(asked[name], name)
        if first != name:
            raise InputError(name, f"it is the {first}, '{asked[name]}'", "Give it its own topic.")
    if asked["queue"] < 1:
        raise InputError("queue", f"{asked['queue']} clouds", "Give 1 or more.")


def reach_of(dry: str) -> Visibility:
    """The reach of a dry scan, a file.

    Raises:
        InputError: It cannot be read, or shows too little to compare with.
    """
    scan = read_scan(Path(dry))
    reach = ScanWeather.of(scan, np.zeros(len(scan), bool)).reach
    if reach.at_least < ERROR.above:
        reason = f"its reach is {reach}, less than {ERROR.above:g} m, where the error ends"
        raise InputError(dry, reason, "Give a dry scan of a wider place.")
    return reach


class DerainNode:
    """Subscribes to clouds, publishes them without rain.

    Args:
        node: A node of rclpy.

    Raises:
        InputError: Parameters that no node can run with, or a model or dry scan that is not there.
    """

    def __init__(self, node: Any) -> None:
        from diagnostic_msgs.msg import DiagnosticArray
        from rclpy.qos import QoSProfile, ReliabilityPolicy
        from sensor_msgs.msg import PointCloud2

        self.node = node
        asked = {
            name: node.declare_parameter(name, default).value for name, default in DEFAULTS.items()
        }
        refuse(asked)
        self.organised: bool = asked["organised"]
        derainer = Derainer(asked["model"] or None, threads=asked["threads"])
        derainer.warns = False  # what is odd goes to the node's log
        self.remover = RainRemover(
            derainer,
            alarm=Alarm(dry=reach_of(asked["dry"]) if asked["dry"] else None),
        )
        # A sensor's driver repeats no cloud that was lost, and asking it to would find no driver.
        newest = QoSProfile(depth=asked["queue"], reliability=ReliabilityPolicy.BEST_EFFORT)
        # Who listens may ask for either: a reliable publisher suits both.
        reliable = QoSProfile(depth=asked["queue"], reliability=ReliabilityPolicy.RELIABLE)
        self.clean = node.create_publisher(PointCloud2, asked["output"], reliable)
        self.removed = (
            node.create_publisher(PointCloud2, asked["removed"], reliable)
            if asked["removed"]
            else None
        )
        self.diagnostics = node.create_publisher(DiagnosticArray, "/diagnostics", 1)
        node.create_subscription(PointCloud2, asked["input"], self.take, newest)
        node.create_timer(DIAGNOSTIC_PERIOD, self.report)

    def take(self, message: Any) -> None:
        """Cleans one cloud. Errors are logged, and the node goes on."""
        try:
            judgement = self.remover.judge(message)
            rain = rain_to_remove(judgement)
            without_rain = cleaned(message, rain, self.organised)
        except (InputError, ValueError) as error:
            self.node.get_logger().error(f"a cloud is left out: {error}", throttle_duration_sec=5.0)
            return
        self.clean.publish(without_rain)
        if self.removed is not None:
            self.removed.publish(removed(message, rain))
        for text in self.remover.news(judgement):
            self.node.get_logger().warning(text)

    def report(self) -> None:
        """Publishes the diagnostic of the last second."""
        from diagnostic_msgs.msg import DiagnosticArray, DiagnosticStatus, KeyValue

        tally = self.remover.tally_so_far()
        levels = (DiagnosticStatus.OK, DiagnosticStatus.WARN, DiagnosticStatus.ERROR)
        status = DiagnosticStatus(
            level=levels[max(tally.level, Level.WARNING if tally.warning else Level.CLEAR)],
            name=f"{self.node.get_name()}: rain",
            message=tally.warning
            or f"{tally.share:.1%} of the valid points are rain, "
            f"visibility {tally.weather.visibility}",
            hardware_id=self.remover.derainer.name,
            values=[KeyValue(key=key, value=value) for key, value in tally.values().items()],
        )
        report = DiagnosticArray(status=[status])
        report.header.stamp = self.node.get_clock().now().to_msg()
        self.diagnostics.publish(report)


def main() -> int:
    """Runs the node until it is stopped."""
    import rclpy
    from rclpy.executors import ExternalShutdownException

    keep_freed_memory()  # the memory of one cloud serves the next
    rclpy.init()
    node = rclpy.create_node("derain")
    try:
        DerainNode(node)
        rclpy.spin(node)
    except InputError as error:
        node.get_logger().fatal(str(error))
        return 2
    except (KeyboardInterrupt, ExternalShutdownException):
        pass
    except Exception:
        # Stopped while a cloud was cleaned, which there is no longer anybody to publish for.
        if rclpy.ok():
            raise
    finally:
        node.destroy_node()
        rclpy.try_shutdown()
    return 0


if __name__ == "__main__":
    sys.exit(main())
