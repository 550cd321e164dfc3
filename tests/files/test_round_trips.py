"""Whatever columns a scan has, every format that can hold them gives them back bit for bit."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from derain import InputError, Scan
from derain.evaluation.hard_cases import scene
from derain.files import DEFAULT_COLUMNS, read_scan, write_scan
from derain.files.columns import scan_of
from derain.files.formats.pcd import ENCODINGS, VALUE_TYPES, PcdHeader
from derain.files.formats.ply import BYTE_ORDERS, PlyHeader

FLOATS = ("f4", "f8")
TEXT_TYPES = (*VALUE_TYPES, "b1", "f2")
NAMES = st.text("abcdefgh_0123456789-.äλ", min_size=2, max_size=6)
# A test's own folder serves all of its examples.
EXAMPLES = settings(max_examples=25, suppress_health_check=[HealthCheck.function_scoped_fixture])


@st.composite
def scans(
    draw: st.DrawFn,
    types: tuple[str, ...],
    names: st.SearchStrategy[str] = NAMES,
    counts: tuple[tuple[int, ...], ...] = ((),),
) -> Scan:
    """A scan of up to six points with up to four further columns of random bits."""
    points = draw(st.integers(0, 6))
    columns = [(axis, draw(st.sampled_from(FLOATS)), ()) for axis in "xyz"]
    further = draw(st.lists(names, max_size=4, unique_by=str.lower))
    columns += [
        (name, draw(st.sampled_from(types)), draw(st.sampled_from(counts))) for name in further
    ]
    fields = {}
    for name, kind, shape in draw(st.permutations(columns)):
        bits = draw(arrays(f"u{kind[1]}", (points, *shape)))
        fields[name] = bits > 127 if kind == "b1" else bits.view(f"<{kind}")
    return scan_of(Path("drawn"), fields)


def check_same(copy: Scan, scan: Scan, *, payload: bool = True) -> None:
    """The columns are the same bits, or, without the payload of NaN, the same values."""
    assert list(copy.fields) == list(scan.fields)
    for name, column in scan.fields.items():
        other = copy.fields[name]
        assert other.dtype.newbyteorder("<") == column.dtype
        assert other.shape == column.shape
        if payload or column.dtype.kind != "f":
            assert other.astype(f"V{column.itemsize}").tobytes() == column.tobytes()
        else:
            np.testing.assert_array_equal(other, column)
            whole = ~np.isnan(column)
            np.testing.assert_array_equal(np.signbit(other[whole]), np.signbit(column[whole]))
    np.testing.assert_array_equal(copy.xyz, scan.xyz)


# What draws scans that a format can hold.
DRAWN = {
    ".pcd": scans(VALUE_TYPES, counts=((), (2,), (7,))),
    ".ply": scans(("i1", "u1", "i2", "u2", "i4", "u4", "f4", "f8")),
    ".npy": scans((*VALUE_TYPES, "f2"), st.text("abcd_0123456789-.", min_size=2), ((), (2, 3))),
    ".feather": scans((*VALUE_TYPES, "f2"), st.text("abä _", min_size=2, max_size=5)),
}
DRAWN[".npz"] = DRAWN[".npy"]
HEADERS = {
    ".pcd": [PcdHeader((), 0, 0, 0, encoding) for encoding in ENCODINGS],
    ".ply": [PlyHeader(encoding) for encoding in BYTE_ORDERS],
}


@EXAMPLES
@pytest.mark.parametrize(
    ("suffix", "header"),
    [(suffix, header) for suffix in DRAWN for header in HEADERS.get(suffix, [None])],
)
@given(data=st.data())
def test_columns_come_back_whole_and_cleaned(tmp_path, suffix, header, data) -> None:
    scan, path = data.draw(DRAWN[suffix]), tmp_path / f"scan{suffix}"
    payload = header is None or header.encoding not in ("ascii", "binary_big_endian")
    write_scan(path, replace(scan, header=header))
    copy = read_scan(path, tuple(scan.fields))
    check_same(copy, scan, payload=payload)
    stay = data.draw(arrays(bool, len(scan)))
    write_scan(path, copy.take(stay))
    check_same(read_scan(path, tuple(scan.fields)), scan.take(stay), payload=payload)


@EXAMPLES
@given(rows=arrays(np.uint32, st.tuples(st.integers(0, 6), st.just(4))))
def test_bin(tmp_path, rows) -> None:
    rows[:, 3] &= 0x7FFF_FFFF  # no intensity is negative
    (tmp_path / "scan.bin").write_bytes(rows.astype("<u4").tobytes())
    scan = read_scan(tmp_path / "scan.bin")
    assert list(scan.fields) == list(DEFAULT_COLUMNS)
    write_scan(tmp_path / "copy.bin", scan)
    assert (tmp_path / "copy.bin").read_bytes() == rows.astype("<u4").tobytes()


@pytest.mark.parametrize("header", [*HEADERS[".pcd"], *HEADERS[".ply"]])
def test_open3d_reads_what_is_written(tmp_path, scan, header, open3d) -> None:
    fields, path = dict(scan.fields), tmp_path / "scan.pcd"
    if isinstance(header, PlyHeader):
        path = tmp_path / "scan.ply"
        del fields["ring"]  # Open3D skips properties of 16 bits there
    write_scan(path, replace(scan, fields=fields, header=header))
    cloud = open3d.t.io.read_point_cloud(str(path))
    np.testing.assert_array_equal(cloud.point["positions"].numpy(), scan.xyz, strict=True)
    for name in fields.keys() - set("xyz"):
        np.testing.assert_array_equal(cloud.point[name].numpy().ravel(), fields[name], strict=True)


PLAIN_NAMES = st.text("abcd_ä", min_size=2)
# With what CSV itself is made of, and with bytes that are not UTF-8.
CSV_NAMES = st.text("ab;,\"' äλ\udce4", min_size=2, max_size=6).filter(lambda n: n == n.strip())


@EXAMPLES
@pytest.mark.parametrize(
    ("suffix", "names"),
    [(".txt", PLAIN_NAMES), (".xyz.gz", PLAIN_NAMES), (".csv", CSV_NAMES)],
)
@given(data=st.data())
def test_text_gives_back_values_in_64_bits(tmp_path, suffix, names, data) -> None:
    scan, path = data.draw(scans(TEXT_TYPES, names)), tmp_path / f"scan{suffix}"
    write_scan(path, scan)
    copy = read_scan(path)
    # Compared as the type that was written: int64 and uint64 have no common one without loss.
    narrow = {name: each.astype(scan.fields[name].dtype) for name, each in copy.fields.items()}
    check_same(replace(copy, fields=narrow), scan, payload=False)
    for name, column in scan.fields.items():
        whole = len(scan) > 0 and column.dtype.kind != "f"
        assert copy.fields[name].dtype in ((np.int64, np.uint64) if whole else (np.float64,))
        if column.dtype.kind == "f":
            np.testing.assert_array_equal(copy.fields[name], column.astype(np.float64))


@pytest.mark.parametrize("suffix", [".npz", ".npy", ".pcd", ".ply", ".feather"])
def test_a_file_that_is_cut_off_is_refused(tmp_path, suffix) -> None:
    path = tmp_path / f"scan{suffix}"
    write_scan(path, scene(90))
    content = path.read_bytes()
    for size in (0, 1, 5, 20, 200, 300):
        path.write_bytes(content[:size])
        with pytest.raises(InputError, match=rf"cannot be read as \{suffix}"):
            read_scan(path)
