"""The node of ROS 2, without ROS: its messages are made up here, and so is what it hangs on."""

import array
from dataclasses import replace
from types import ModuleType

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.scan import Bools, Float32s

from .hard_points import KEPT
from .made_up_ros import (
    POINT,
    DiagnosticArray,
    DiagnosticStatus,
    Field,
    KeyValue,
    Node,
    PointCloud2,
    message_of,
)

pytestmark = pytest.mark.usefixtures("ros")


def started(ros2_node: ModuleType, **parameters: str) -> Node:
    """A node on which the example hangs."""
    node = Node(model=str(KEPT), threads=1, **parameters)
    ros2_node.DerainNode(node)
    return node


@pytest.mark.parametrize("share", [0.0, 0.3])
def test_a_cloud_is_parted_into_what_stays_and_what_is_removed(ros2_node, share) -> None:
    message = message_of(scene(200), height=4, gap=9)
    rain = np.random.default_rng(1).random(200) < share
    cleaned, removed = ros2_node.cleaned(message, rain), ros2_node.removed(message, rain)
    for result, rows in ((cleaned, ~rain), (removed, rain)):
        expected = ros2_node.PointCloud.of(message).take(rows)
        assert vars(ros2_node.PointCloud.of(result)) == vars(expected)
        assert isinstance(result.data, array.array)
        assert result.header is message.header
        assert result is not message


def test_of_an_organised_cloud_rain_becomes_nan_in_its_place(ros2_node) -> None:
    message = message_of(scene(200), height=4, gap=9)
    rain = np.zeros(200, bool)
    rain[[3, 70, 199]] = True
    result = ros2_node.cleaned(message, rain, organised=True)
    before, after = (
        np.frombuffer(one.data, np.uint8).reshape(4, -1)[:, : 50 * 23].copy().view(POINT).ravel()
        for one in (message, result)
    )
    assert (result.height, result.width, result.row_step) == (4, 50, 50 * 23 + 9)
    assert after[~rain].tobytes() == before[~rain].tobytes()
    assert all(np.isnan(after[axis][rain]).all() for axis in "xyz")
    assert not result.is_dense
    np.testing.assert_array_equal(after["ring"], before["ring"])


def test_what_is_odd_is_logged_once(ros2_node) -> None:
    points = scene(600)
    points[:, 3] = 5  # which no sensor measured
    remover = ros2_node.RainRemover(Derainer(KEPT, threads=1))
    news = [remover.news(remover.judge(message_of(points))) for _ in range(2)]
    assert "replaced by the mean" in news[0][0]
    assert news[1] == []


def test_a_cloud_comes_in_and_goes_out_clean(ros2_node, monkeypatch) -> None:
    monkeypatch.setattr(ros2_node, "MOST_RAIN", 1.0)  # of so few points much is called rain
    points = scene(600)
    message = message_of(points)
    node = started(ros2_node, input="in", output="out", removed="gone")
    kind, call, quality = node.subscriptions["in"]
    assert (kind, quality.depth, quality.reliability) == (PointCloud2, 1, "best effort")
    call(message)
    rain = Derainer(KEPT, threads=1)(points)
    assert 0 < rain.sum() < len(rain)
    expected = {"out": ros2_node.cleaned(message, rain), "gone": ros2_node.removed(message, rain)}
    for topic, one in expected.items():
        kind, published, quality = node.publishers[topic]
        assert (kind, published, quality.reliability) == (PointCloud2, [one], "reliable")


@pytest.mark.parametrize(("share", "stay"), [(0.35, 130), (0.36, 200)])
def test_a_cloud_that_would_lose_too_much_goes_out_whole(
    ros2_node, monkeypatch, share, stay
) -> None:
    calling_rain(monkeypatch, ros2_node, np.arange(200) < 200 * share)
    node = started(ros2_node, removed="gone")
    node.subscriptions["points"][1](message_of(scene(200)))
    published = [node.publishers[topic][1][0].width for topic in ("points/clean", "gone")]
    assert published == [stay, 200 - stay]


def calling_rain(patch: pytest.MonkeyPatch, ros2_node: ModuleType, rain: Bools) -> None:
    """Has the model call these points rain."""
    usual = Derainer.judge
    patch.setattr(
        ros2_node.Derainer, "judge", lambda self, scan: replace(usual(self, scan), rain=rain)
    )


def level_after(ros2_node: ModuleType, points: Float32s, dry: str = "") -> str:
    """The level that the node reports after a cloud."""
    node = started(ros2_node, dry=dry)
    node.subscriptions["points"][1](message_of(points))
    node.timers[0][1]()
    (published,) = node.publishers["/diagnostics"][1]
    return {b"\0": "OK", b"\1": "WARN", b"\2": "ERROR"}[published.status[0].level]


def test_its_level_is_that_of_the_weather(ros2_node, monkeypatch, tmp_path) -> None:
    points = scene(2000)
    points[:400, :3] *= 3 / np.linalg.norm(points[:400, :3], axis=1, keepdims=True)
    for drops, level in ((0, "OK"), (400, "ERROR")):
        calling_rain(monkeypatch, ros2_node, np.arange(2000) < drops)
        assert level_after(ros2_node, points) == level
    # Beside a dry scan, it is that of range that is lost as well.
    reach = np.linspace(10, 80, 2000)[:, None]
    points[:, :3] *= reach / np.linalg.norm(points[:, :3], axis=1, keepdims=True)
    points.tofile(tmp_path / "dry.bin")
    calling_rain(monkeypatch, ros2_node, np.zeros(400, bool))
    for dry, level in (("", "OK"), (str(tmp_path / "dry.bin"), "WARN")):
        assert level_after(ros2_node, points[:400], dry) == level  # up to 24 m


def test_by_default_it_runs_the_packaged_model_and_publishes_no_rain(ros2_node) -> None:
    node = Node()
    made = ros2_node.DerainNode(node)
    assert made.remover.derainer.name == "default"
    assert set(node.publishers) == {"points/clean", "/diagnostics"}
    assert set(node.subscriptions) == {"points"}


def test_a_cloud_of_no_points_goes_out_as_it_came_in(ros2_node) -> None:
    node = started(ros2_node)
    nothing = message_of(scene(200)[:0])
    nothing.fields = []  # as of a message that nobody filled
    nothing.point_step = 0
    node.subscriptions["points"][1](nothing)
    (published,) = node.publishers["points/clean"][1]
    assert vars(ros2_node.PointCloud.of(published)) == vars(ros2_node.PointCloud.of(nothing))
    assert node.logger == []


def test_a_cloud_that_cannot_be_read_is_logged_and_the_next_one_is_cleaned(ros2_node) -> None:
    node = started(ros2_node)
    _, call, _ = node.subscriptions["points"]
    flat, short = message_of(scene(200)), message_of(scene(200))
    flat.fields = [one for one in flat.fields if one.name != "z"]
    del short.data[100:]
    for message in (flat, short, message_of(scene(200))):
        call(message)
    assert len(node.logger) == 2
    assert all(text.startswith("a cloud is left out: ") for text in node.logger)
    assert len(node.publishers["points/clean"][1]) == 1
    empty = message_of(scene(200))  # goes through
    empty.width, empty.row_step, empty.data = 0, 0, array.array("B")
    call(empty)
    assert node.publishers["points/clean"][1][1:] == [empty]


def test_once_a_second_it_publishes_the_share_of_rain(ros2_node) -> None:
    points = scene(600)
    node = started(ros2_node)
    ((period, report),) = node.timers
    node.subscriptions["points"][1](message_of(points))
    report()
    report()
    published, silent = (one.status[0] for one in node.publishers["/diagnostics"][1])
    values = {one.key: one.value for one in published.values}
    judgement = Derainer(KEPT, threads=1).judge(points)
    share, visibility = judgement.rain.mean(), judgement.weather.visibility
    assert period == 1.0
    assert (values["clouds"], values["points per cloud"]) == ("1", "600")
    assert float(values["share of rain"]) == pytest.approx(share, abs=1e-4)
    assert values["visibility"] == str(visibility)
    assert values["reach"] == str(judgement.weather.reach)
    assert (silent.level, silent.message) == (DiagnosticStatus.WARN, "no clouds")


def test_the_messages_made_up_here_have_the_attributes_of_those_of_ros() -> None:
    typesys = pytest.importorskip("rosbags.typesys")
    types = typesys.get_typestore(typesys.Stores.ROS2_JAZZY).types
    for made_up, name in (
        (PointCloud2, "sensor_msgs/msg/PointCloud2"),
        (Field, "sensor_msgs/msg/PointField"),
        (DiagnosticArray, "diagnostic_msgs/msg/DiagnosticArray"),
        (DiagnosticStatus, "diagnostic_msgs/msg/DiagnosticStatus"),
        (KeyValue, "diagnostic_msgs/msg/KeyValue"),
    ):
        # The library has constants and the type's name among them.
        real = {each for each in types[name].__dataclass_fields__ if each[0].islower()}
        assert set(made_up.__dataclass_fields__) == real, name
