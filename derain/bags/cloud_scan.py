"""A point cloud of ROS as a scan."""

from pathlib import Path

from derain.bags.point_cloud import PointCloud
from derain.files.columns import scan_of
from derain.scan import Scan, named

AXES = ("x", "y", "z")


def scan_of_cloud(name: Path, cloud: PointCloud) -> Scan:
    """The scan of a cloud, one point per point of the cloud, row after row.

    ROS has the axes that derain has: x forward, y left, z up, metres.

    Args:
        name: What messages call it.
        cloud: The cloud.

    Returns:
        The scan, every field of the cloud as a column.

    Raises:
        InputError: No x, y and z, or several columns that could be one of them.
        ValueError: Coordinates that are not floating-point numbers of one value each, and so in no
            known unit.
    """
    columns = cloud.columns()
    for axis in AXES:
        column = named(columns, axis, name)
        if column is not None and (column.ndim > 1 or column.dtype.kind != "f"):
            count = f" of {column.shape[1]} values" if column.ndim > 1 else ""
            raise ValueError(
                f"{axis} is {column.dtype}{count}, of which nobody says how many make a metre"
            )
    shape = (cloud.height, cloud.width) if cloud.is_organised and len(cloud) else None
    return scan_of(name, columns, shape)
