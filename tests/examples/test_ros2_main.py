"""The node of ROS 2 from its start to its end, and the file that launches it."""

import runpy
import sys
from types import ModuleType

import pytest

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer

from .hard_points import KEPT
from .made_up_ros import EXAMPLE, ExternalShutdownError, Node, Ros, message_of

pytestmark = pytest.mark.usefixtures("ros")


def run_main(ros2_node: ModuleType, patch: pytest.MonkeyPatch, ros: Ros) -> int:
    """Runs the example as the command line does."""
    for name in ("init", "create_node", "spin", "ok", "try_shutdown"):
        patch.setattr(sys.modules["rclpy"], name, getattr(ros, name), raising=False)
    executors = ModuleType("rclpy.executors")
    executors.ExternalShutdownException = ExternalShutdownError
    patch.setitem(sys.modules, "rclpy.executors", executors)
    return ros2_node.main()


@pytest.mark.parametrize("ending", [None, KeyboardInterrupt(), ExternalShutdownError()])
def test_it_runs_from_the_first_cloud_until_it_is_stopped(ros2_node, monkeypatch, ending) -> None:
    monkeypatch.setattr(ros2_node, "MOST_RAIN", 1.0)  # of so few points much is called rain
    message = message_of(scene(300))
    ros = Ros(Node(model=str(KEPT), threads=1), [message, message], ending)
    assert run_main(ros2_node, monkeypatch, ros) == 0
    rain = Derainer(KEPT, threads=1)(scene(300))
    _, published, _ = ros.node.publishers["points/clean"]
    assert published == [ros2_node.cleaned(message, rain)] * 2
    assert len(ros.node.publishers["/diagnostics"][1]) == 1
    assert (ros.node.destroyed, ros.running, ros.node.logger) == (True, False, [])


@pytest.mark.parametrize(
    ("parameters", "reason"),
    [
        ({"model": "none.onnx"}, "none.onnx: "),
        ({"input": "a", "output": "a"}, "output: it is the input, 'a'"),
        ({"removed": "points"}, "removed: it is the input, 'points'"),
        ({"output": "a", "removed": "a"}, "removed: it is the output, 'a'"),
        ({"queue": 0}, "queue: 0 clouds"),
        ({"dry": "empty.bin"}, "empty.bin: its reach is not known"),
    ],
)
def test_what_it_cannot_run_with_is_logged_once_and_ends_it(
    ros2_node, monkeypatch, tmp_path, parameters, reason
) -> None:
    monkeypatch.chdir(tmp_path)
    (tmp_path / "empty.bin").touch()
    ros = Ros(Node(threads=1, **parameters), [])
    assert run_main(ros2_node, monkeypatch, ros) == 2
    (logged,) = ros.node.logger
    assert logged.startswith(reason)
    assert (ros.node.destroyed, ros.running) == (True, False)


def test_a_fault_ends_it_unless_it_is_being_stopped(ros2_node, monkeypatch) -> None:
    fault = RuntimeError("publisher's context is invalid")
    ros = Ros(Node(threads=1), [], fault)
    with pytest.raises(RuntimeError, match="context is invalid"):
        run_main(ros2_node, monkeypatch, ros)
    stopped = Ros(Node(threads=1), [], fault)
    stopped.ok = lambda: False
    assert run_main(ros2_node, monkeypatch, stopped) == 0


def test_the_launch_file_sets_parameters_of_the_node(ros2_node, monkeypatch) -> None:
    made = {
        "launch": "LaunchDescription",
        "launch.actions": "DeclareLaunchArgument",
        "launch.substitutions": "LaunchConfiguration",
        "launch_ros": "",
        "launch_ros.actions": "Node",
        "launch_ros.parameter_descriptions": "ParameterValue",
    }
    for name, member in made.items():
        module = ModuleType(name)
        vars(module)[member] = lambda *values, **named: (values, named)
        monkeypatch.setitem(sys.modules, name, module)
    launch = runpy.run_path(str(EXAMPLE / "derain.launch.py"))
    ((described,), _) = launch["generate_launch_description"]()
    assert {name: kind for name, (kind, _) in launch["PARAMETERS"].items()} == {
        name: type(default) for name, default in ros2_node.DEFAULTS.items() if name != "queue"
    }
    (_, node) = described[-1]
    assert set(node["parameters"][0]) == set(launch["PARAMETERS"])
    assert node["arguments"] == [str(EXAMPLE / "derain_node.py")]
