"""The cloud of a ``sensor_msgs/PointCloud2``: bytes, and the fields that describe them.

Points are removed and fields are added without looking at the other bytes, so that padding, byte
order and fields of any type stay what they are.

Source: sensor_msgs/msg/PointCloud2 and PointField of ROS, the same in ROS 1 and ROS 2.
"""

from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from typing import Any, Self

import numpy as np
from numpy.typing import NDArray

from derain.files.columns import scan_of
from derain.files.content import check_columns
from derain.scan import Array, Bools, Float32s, Scan, named

# PointField's datatypes, in NumPy's spelling.
DATATYPES = {1: "i1", 2: "u1", 3: "i2", 4: "u2", 5: "i4", 6: "u4", 7: "f4", 8: "f8"}
FLOAT32_DATATYPE = 7

AXES = ("x", "y", "z")


@dataclass(frozen=True)
class PointField:
    """One field of every point.

    Attributes:
        name: Its name; one without a name is padding.
        offset: Bytes from the start of a point.
        datatype: One of DATATYPES.
        count: Values per point; 0, which some drivers write, means 1 as it does to PCL.
    """

    name: str
    offset: int
    datatype: int
    count: int

    def dtype(self, order: str) -> np.dtype[Any]:
        """Its type in an array.

        Args:
            order: Byte order, ``<`` or ``>``.

        Raises:
            ValueError: PointCloud2 has no such datatype.
        """
        if self.datatype not in DATATYPES:
            raise ValueError(f"field '{self.name}' has the unknown datatype {self.datatype}")
        value = np.dtype(order + DATATYPES[self.datatype])
        return value if self.count < 2 else np.dtype((value, (self.count,)))


@dataclass(frozen=True, eq=False)
class PointCloud:
    """The part of a PointCloud2 that is about points.

    Attributes:
        height: Rows of an organised cloud; 1 of any other.
        width: Points in a row.
        fields: Fields of a point, in the order of the message.
        is_bigendian: True if numbers are in big-endian byte order.
        point_step: Bytes of a point.
        row_step: Bytes of a row, with padding at its end if it has any.
        data: Bytes of all rows.
        is_dense: True if all points are finite, as the driver states.

    Raises:
        ValueError: Fields, steps and bytes that contradict each other.
    """

    height: int
    width: int
    fields: tuple[PointField, ...]
    is_bigendian: bool
    point_step: int
    row_step: int
    data: bytes | memoryview
    is_dense: bool

    @classmethod
    def of(cls, message: Any) -> Self:
        """The cloud of a message, as rclpy or rosbags has it; its bytes are not copied.

        Raises:
            ValueError: A message that contradicts itself.
        """
        return cls(
            message.height,
            message.width,
            tuple(PointField(f.name, f.offset, f.datatype, f.count) for f in message.fields),
            message.is_bigendian,
            message.point_step,
            message.row_step,
            memoryview(message.data),
            message.is_dense,
        )

    def __post_init__(self) -> None:
        check_columns(len(self.fields))
        names = [field.name for field in self.fields if field.name]
        if len(set(names)) < len(names):
            raise ValueError(f"a field comes twice among {', '.join(names)}")
        for field in self.fields:
            end = field.offset + field.dtype("<").itemsize
            if end > self.point_step:
                raise ValueError(
                    f"field '{field.name}' ends at byte {end:,} of points of {self.point_step:,}"
                )
        if not self.height * self.width:  # may be more than a length before the checks
            return
        if (
            not self.point_step
            or (self.is_organised and self.row_step < self.width * self.point_step)
            or len(self.data) < self.height * self._step_of_rows
        ):
            raise ValueError(
                f"{len(self.data):,} bytes hold no {self.height:,} x {self.width:,} points of "
                f"{self.point_step:,} in rows of {self._step_of_rows:,}"
            )

    def __len__(self) -> int:
        return self.height * self.width

    @property
    def is_organised(self) -> bool:
        """True if its rows are rows of the sensor."""
        return self.height > 1

    def columns(self) -> dict[str, Array]:
        """Name → its values, (N,) or (N, count), row after row, in the byte order of the machine.

        Read-only views of the bytes where that order is the cloud's own; padding is left out.
        """
        named = [field for field in self.fields if field.name]
        table = np.dtype(
            {
                "names": [field.name for field in named],
                "formats": [field.dtype(self._order) for field in named],
                "offsets": [field.offset for field in named],
                "itemsize": self.point_step,
            }
        )
        if not named or not len(self):
            return {f.name: np.empty((0, *f.dtype("=").shape), f.dtype("=").base) for f in named}
        points = self._points.view(table)[:, 0]
        return {f.name: points[f.name].astype(f.dtype("=").base, copy=False) for f in named}

    def take(self, rows: Bools) -> Self:
        """Some of its points only, every byte of each as it was, as an unorganised cloud.

        Where all of an unorganised cloud are taken, it stays as it is.

        Args:
            rows: Mask of points, bool (N,).
        """
        if rows.all():
            return self
        # One item a point, which is several times faster to choose from than bytes.
        taken = self._points.view(f"V{self.point_step}")[:, 0][rows]
        return replace(
            self,
            height=1,
            width=len(taken),
            row_step=len(taken) * self.point_step,
            data=taken.tobytes(),
        )

    def blank(self, rows: Bools) -> Self:
        """The same cloud in its shape, where x, y and z of some points are no numbers.

        Args:
            rows: Mask of points, bool (N,).

        Raises:
            ValueError: No x, y and z that can hold what is no number.
        """
        if not rows.any():
            return self
        data = bytearray(self.data)
        by_name = {field.name: field for field in self.fields}
        for axis in AXES:
            if (field := named(by_name, axis, "the cloud")) is not None:
                values: Array = np.ndarray(
                    (self.height, self.width),
                    field.dtype(self._order),
                    data,
                    field.offset,
                    (self._step_of_rows, self.point_step),
                )
                values[rows.reshape(values.shape)] = np.nan
        return replace(self, data=bytes(data), is_dense=False)

    def with_field(self, name: str, values: Float32s) -> Self:
        """The same points with a field of float32 after those that they have.

        One that is there already, as in a bag that was cleaned before, takes the new values.
        Padding at the end of rows goes, for there is none that would still be right.

        Args:
            name: Name of the field.
            values: Its values, float32 (N,).

        Raises:
            ValueError: A field of this name that is not one float32.
        """
        fields, step = {field.name: field for field in self.fields}, self.point_step
        if name not in fields:
            fields[name] = PointField(name, step, FLOAT32_DATATYPE, 1)
            step += 4
        field = fields[name]
        if field.datatype != FLOAT32_DATATYPE or field.count > 1:
            raise ValueError(f"it has another field '{name}' already")
        points = np.empty((len(self), step), np.uint8)
        if len(self):
            points[:, : self.point_step] = self._points
        written = np.ascontiguousarray(values, f"{self._order}f4").view(np.uint8).reshape(-1, 4)
        points[:, field.offset : field.offset + 4] = written
        return replace(
            self,
            fields=self.fields if step == self.point_step else (*self.fields, field),
            point_step=step,
            row_step=self.width * step,
            data=points.tobytes(),
        )

    @property
    def _order(self) -> str:
        return ">" if self.is_bigendian else "<"

    @property
    def _step_of_rows(self) -> int:
        """Bytes from row to row; of one row alone, which some drivers write as 0, its points'."""
        return self.row_step if self.is_organised else self.width * self.point_step

    @cached_property
    def _points(self) -> NDArray[np.uint8]:
        """Bytes of every point, uint8 (N, point_step)."""
        rows = np.frombuffer(self.data, np.uint8, self.height * self._step_of_rows)
        within = rows.reshape(self.height, -1)[:, : self.width * self.point_step]
        return np.ascontiguousarray(within).reshape(-1, self.point_step)


def scan_of_cloud(name: Path, cloud: PointCloud) -> Scan:
    """The scan of a cloud, one point per point of the cloud, row after row.

    ROS has the axes that derain has: x forward, y left, z up, metres.

    Args:
        name: Names it in messages.
        cloud: The cloud.

    Returns:
        The scan, every field of the cloud as a column.

    Raises:
        InputError: Points without x, y and z, or several columns that could be one of them.
        ValueError: Coordinates that are not floating-point numbers of one value each, and so in no
            known unit.
    """
    columns = cloud.columns()
    if not len(cloud):  # then a node may have set no fields
        columns = dict.fromkeys((*AXES, "intensity"), np.empty(0, np.float32)) | columns
    for axis in AXES:
        column = named(columns, axis, name)
        if column is not None and (column.ndim > 1 or column.dtype.kind != "f"):
            count = f" of {column.shape[1]} values" if column.ndim > 1 else ""
            raise ValueError(f"{axis} is {column.dtype}{count}, whose unit is not known")
    shape = (cloud.height, cloud.width) if cloud.is_organised and len(cloud) else None
    return scan_of(name, columns, shape)
