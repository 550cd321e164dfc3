"""What is left of a cloud when its rain is gone, and what that was, as messages."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.bags.cloud_message import CloudMessage
from derain.bags.point_cloud import PointCloud


@dataclass(frozen=True)
class CleanedMessages:
    """Two messages of one.

    Attributes:
        clean: The cloud without its rain.
        removed: Its rain alone.
    """

    clean: bytes
    removed: bytes


def cleaned(
    message: CloudMessage,
    rain: NDArray[np.bool_],
    columns: Mapping[str, NDArray[np.float32]] | None = None,
    keep_shape: bool = False,
) -> CleanedMessages:
    """Divides a cloud; every byte of a point stays what it is.

    By default points of rain are gone, as in cleaned files, and an organised cloud is none any
    more: nobody takes a point for one that is not there. Where the next node needs rows and columns
    of the sensor, the cloud can keep its shape, with no numbers for coordinates.

    Args:
        message: The cloud.
        rain: Which of its points are rain, bool (N,).
        columns: Fields to be added, or given other values: name → float32 (N,).
        keep_shape: Whether an organised cloud stays one.

    Raises:
        ValueError: A field of that name and another type, or coordinates that cannot be blank.
    """
    columns = columns or {}
    if keep_shape and message.cloud.is_organised:
        clean = message.cloud.blank(rain).with_columns(columns)
    else:
        clean = _part(message.cloud, ~rain, columns)
    removed = _part(message.cloud, rain, columns)
    return CleanedMessages(
        message.with_cloud(clean).to_bytes(), message.with_cloud(removed).to_bytes()
    )


def _part(
    cloud: PointCloud, rows: NDArray[np.bool_], columns: Mapping[str, NDArray[np.float32]]
) -> PointCloud:
    return cloud.take(rows).with_columns({name: values[rows] for name, values in columns.items()})
