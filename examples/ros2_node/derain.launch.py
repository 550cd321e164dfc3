"""Starts the node that takes the rain out of a topic of point clouds.

    ros2 launch derain.launch.py
    ros2 launch derain.launch.py input:=/velodyne_points output:=/velodyne_points/clean

The node runs by the Python of ``python``: that of the environment in which derain is installed.
"""

from pathlib import Path

from launch import LaunchDescription
from launch.actions import DeclareLaunchArgument
from launch.substitutions import LaunchConfiguration
from launch_ros.actions import Node
from launch_ros.parameter_descriptions import ParameterValue

NODE = Path(__file__).resolve().parent / "derain_node.py"

# What may be set on the command line, with its type and default; derain_node.py explains each.
PARAMETERS = {
    "input": (str, "/ouster/points"),
    "output": (str, "/ouster/points/clean"),
    "removed": (str, ""),
    "model": (str, ""),
    "dry": (str, ""),
    "threads": (int, "0"),
    "organised": (bool, "false"),
}


def generate_launch_description() -> LaunchDescription:
    """The node, started again whenever it ends."""
    arguments = [DeclareLaunchArgument("python", default_value="python3")]
    arguments += [
        DeclareLaunchArgument(name, default_value=default)
        for name, (_, default) in PARAMETERS.items()
    ]
    parameters = {
        name: ParameterValue(LaunchConfiguration(name), value_type=kind)
        for name, (kind, _) in PARAMETERS.items()
    }
    node = Node(
        executable=LaunchConfiguration("python"),
        arguments=[str(NODE)],
        name="derain",
        output="screen",
        parameters=[parameters],
        respawn=True,
        respawn_delay=2.0,
    )
    return LaunchDescription([*arguments, node])
