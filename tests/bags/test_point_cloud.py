"""Clouds of any fields: what is kept, what goes, and what is refused."""

from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain.bags.point_cloud import DATATYPES, PointCloud, PointField, scan_of_cloud
from derain.scan import Array


def cloud_of_columns(columns: dict[str, Array], big: bool = False) -> PointCloud:
    """A cloud of columns, packed one after the other."""
    codes = {name: code for code, name in DATATYPES.items()}
    order = ">" if big else "<"
    table = np.rec.fromarrays(
        list(columns.values()), [(name, order + c.dtype.str[1:]) for name, c in columns.items()]
    )
    fields = tuple(
        PointField(name, offset, codes[dtype.str[1:]], 1)
        for name, (dtype, offset) in table.dtype.fields.items()
    )
    step, size = table.itemsize, len(table)
    return PointCloud(1, size, fields, big, step, size * step, table.tobytes(), True)


@st.composite
def clouds(draw: st.DrawFn) -> PointCloud:
    """Clouds of fields anywhere in a point, overlapping or not, with padding of any bytes."""
    fields = []
    for number in range(draw(st.integers(1, 5))):
        datatype, count = draw(st.sampled_from(list(DATATYPES))), draw(st.integers(0, 3))
        fields.append(PointField(f"f{number}", draw(st.integers(0, 12)), datatype, count))
    ends = [field.offset + field.dtype("<").itemsize for field in fields]
    step = max(ends) + draw(st.integers(0, 7))
    height, width = draw(st.integers(1, 3)), draw(st.integers(0, 5))
    row = width * step + (draw(st.integers(0, 9)) if height > 1 else 0)
    data = draw(st.binary(min_size=height * row, max_size=height * row))
    return PointCloud(
        height, width, tuple(fields), draw(st.booleans()), step, row, data, draw(st.booleans())
    )


def points_of(cloud: PointCloud) -> list[bytes]:
    """The bytes of each point, cut out one by one."""
    row_step = cloud.row_step if cloud.height > 1 else cloud.width * cloud.point_step
    starts = [
        row * row_step + column * cloud.point_step
        for row in range(cloud.height)
        for column in range(cloud.width)
    ]
    return [bytes(cloud.data[start : start + cloud.point_step]) for start in starts]


@given(clouds(), st.data())
def test_taking_points_keeps_every_byte_of_them(cloud, data) -> None:
    rows = np.array(data.draw(st.lists(st.booleans(), min_size=len(cloud), max_size=len(cloud))))
    taken = cloud.take(rows.astype(bool))

    assert points_of(taken) == [p for p, keep in zip(points_of(cloud), rows, strict=True) if keep]
    assert (taken.fields, taken.is_bigendian) == (cloud.fields, cloud.is_bigendian)
    assert taken is cloud or (taken.height, taken.row_step) == (1, len(taken) * cloud.point_step)


@given(clouds())
def test_columns_are_read_from_the_bytes(cloud) -> None:
    order, points = ">" if cloud.is_bigendian else "<", points_of(cloud)
    for field in cloud.fields:
        dtype = np.dtype(order + DATATYPES[field.datatype])
        expected = [np.frombuffer(p, dtype, max(field.count, 1), field.offset) for p in points]
        column = cloud.columns()[field.name]
        assert column.dtype.isnative
        assert column.astype(dtype).tobytes() == b"".join(map(bytes, expected))


@given(clouds())
def test_a_column_more_leaves_the_others_in_their_place(cloud) -> None:
    values = np.linspace(0, 1, len(cloud), dtype=np.float32)
    wider = cloud.with_field("probability", values)

    np.testing.assert_array_equal(wider.columns()["probability"], values)
    assert [p[: cloud.point_step] for p in points_of(wider)] == points_of(cloud)
    assert (wider.height, wider.width) == (cloud.height, cloud.width)


X = (PointField("x", 0, 7, 1),)


def test_no_count_means_one_value_and_one_row_needs_no_step() -> None:
    cloud = PointCloud(1, 1, (PointField("x", 0, 7, 0),), False, 4, 0, b"\0\0\x80?", True)
    assert cloud.columns()["x"].tolist() == [1.0]


@pytest.mark.parametrize("fields", [(), X])
@pytest.mark.parametrize("height", [0, 1])
def test_no_points_are_an_empty_scan_whatever_the_fields(fields, height) -> None:
    cloud = PointCloud(height, 0, fields, False, 4 * len(fields), 0, b"", False)
    scan = scan_of_cloud(Path("cloud"), cloud)
    assert scan.xyz.shape == (0, 3)
    assert list(scan.intensity) == []
    assert cloud.take(np.zeros(0, bool)) is cloud


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        ((1, 2, (*X, *X), False, 4, 8, bytes(8), True), "comes twice"),
        ((1, 2, (PointField("x", 2, 7, 1),), False, 4, 8, bytes(8), True), "ends at byte 6"),
        ((1, 2, (PointField("x", 0, 9, 1),), False, 4, 8, bytes(8), True), "datatype 9"),
        (
            (1, 3, X, False, 4, 12, bytes(11), True),
            "11 bytes hold no 1 x 3 points",
        ),
        ((2, 3, X, False, 4, 11, bytes(24), True), "in rows of 11"),
        ((1, 3, (), False, 0, 0, b"", True), "points of 0"),
        ((2**31, 2**31, X, False, 4, 2**32 - 1, b"", True), "in rows of"),
        ((2**32 - 1, 2**32 - 1, X, False, 4, 16, b"", True), "in rows of"),
    ],
)
def test_contradictions_are_refused(arguments, reason) -> None:
    with pytest.raises(ValueError, match=reason):
        PointCloud(*arguments)


def test_a_field_that_is_there_takes_the_new_values() -> None:
    cloud = cloud_of_columns({"p": np.zeros(3, "f4"), "x": np.arange(3, dtype="f4")})
    again = cloud.with_field("p", np.ones(3, np.float32))
    assert again.fields == cloud.fields
    assert again.columns()["p"].tolist() == [1, 1, 1]
    assert again.columns()["x"].tolist() == [0, 1, 2]
    with pytest.raises(ValueError, match="another field 'p'"):
        cloud_of_columns({"p": np.zeros(3, "u2")}).with_field("p", np.ones(3, np.float32))
