"""CSV tables of points: what is read, what is refused, and that every value comes back."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from derain import InputError, Scan
from derain.files import read_scan, write_scan
from derain.files.content import Content, MemoryBudget
from derain.files.formats import table
from derain.files.formats.table import Table

EXTENDED_RADAR = """\
x,y,z,intensity,cross_section,velocity,confidence
12.5,-3.25,0.5,21,7.5,-1.25,0.99
1e1,nan,-0.0,8,,inf,1
"""


@pytest.fixture
def file(tmp_path) -> Path:
    return tmp_path / "scan.csv"


def read(file: Path, text: str | bytes) -> Scan:
    file.write_bytes(text.encode() if isinstance(text, str) else text)
    return read_scan(file)


def test_the_extended_radar_of_rehearse_3d_is_read(file) -> None:
    scan = read(file, EXTENDED_RADAR)
    expected = np.array([[12.5, -3.25, 0.5], [10, np.nan, -0.0]], np.float32)
    np.testing.assert_array_equal(scan.xyz, expected, strict=True)
    assert np.signbit(scan.xyz[1, 2])
    np.testing.assert_array_equal(scan.intensity, np.array([21, 8], np.float32), strict=True)
    assert list(scan.fields) == EXTENDED_RADAR.splitlines()[0].split(",")
    np.testing.assert_array_equal(scan.fields["intensity"], np.array([21, 8]), strict=True)
    np.testing.assert_array_equal(scan.fields["cross_section"], [7.5, np.nan], strict=True)
    np.testing.assert_array_equal(scan.fields["velocity"], [-1.25, np.inf], strict=True)
    np.testing.assert_array_equal(scan.fields["confidence"], [0.99, 1], strict=True)
    assert scan.valid.tolist() == [True, False]


@pytest.mark.parametrize(
    "written",
    [
        lambda text: text.replace(",", " , "),
        lambda text: "\n" + text.replace("\n", "\n  \n\n"),
        lambda text: "\ufeff" + text,
        lambda text: "".join(
            ", ".join(f'"{value}"' for value in line.split(",")) + "\n"
            for line in text.splitlines()
        ),
    ],
    ids=["spaces", "empty lines", "byte order mark", "quotes"],
)
def test_the_many_ways_to_write_a_table_make_no_difference(file, written) -> None:
    expected = read(file, EXTENDED_RADAR)
    scan = read(file, written(EXTENDED_RADAR))
    assert list(scan.fields) == list(expected.fields)
    for name, column in expected.fields.items():
        np.testing.assert_array_equal(scan.fields[name], column, strict=True)


@pytest.mark.parametrize(
    ("text", "last"), [("x,y,z,velocity\n", "velocity"), ("", "intensity"), (" \n\n", "intensity")]
)
def test_names_alone_or_nothing_are_a_scan_of_no_points(file, text, last) -> None:
    scan = read(file, text)
    assert (len(scan), list(scan.fields)) == (0, ["x", "y", "z", last])
    assert {column.dtype for column in scan.fields.values()} == {np.dtype(np.float64)}


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("x,y,z\n1,2,3\n\n1,2\n", "line 4 has 2 values for 3 columns"),
        ("x,y,z\n1,2,3,4\n", "line 2 has 4 values for 3 columns"),
        ("x,y,z\n\n1,2,3\n1,tree,3\n", "line 4: y is 'tree', not a number"),
        ("x,y,z\n1,2,3#4\n", "line 2: z is '3#4', not a number"),
        ("x,y,z,x \n1,2,3,4\n", "line 1 names two columns alike: x, y, z, x"),
        ('x,y,z\n1,"2,3\n', "cannot be read as .csv"),
        ("1,2,3\n4,5,6\n", r"has 3 columns, but 4 are stated .*--columns"),
        ("1 2 3 4 5 6 7" * 200, "1,201 columns, more than 1,024"),
        (bytes(range(256)), "has no x, y and z among its columns|cannot be read as .csv"),
    ],
)
def test_what_is_no_table_of_points_is_refused(file, text, reason) -> None:
    with pytest.raises(InputError, match=reason) as refusal:
        read(file, text)
    assert refusal.value.subject in (file, str(file))


ROWS = [["1", "2.5", "-3", "4"], ["nan", "1e-3", ".5", "+1"]]


@pytest.mark.parametrize("suffix", [".csv", ".xyz"])
@pytest.mark.parametrize("separator", [",", " ; ", " ", "\t", "   "])
@pytest.mark.parametrize("names", ["", "y x z ring", "# y x z ring", "//y x z ring"])
def test_text_is_read_with_names_or_with_columns_stated(tmp_path, suffix, separator, names) -> None:
    file = tmp_path / f"scan{suffix}"
    lines = [separator.join(names.replace("# ", "#").split())] if names else []
    file.write_text("\n".join(lines + [separator.join(row) for row in ROWS]) + "\n")
    scan = read_scan(file, ("y", "x", "z", "ring"))
    expected = np.array([[2.5, 1, -3], [1e-3, np.nan, 0.5]], np.float32)
    np.testing.assert_array_equal(scan.xyz, expected, strict=True)
    np.testing.assert_array_equal(scan.fields["ring"], np.array([4, 1]), strict=True)
    write_scan(file, scan.take(np.array([False, True])))
    assert file.read_text().splitlines() == [*lines, separator.join(ROWS[1])]


@pytest.mark.parametrize(
    "values",
    [
        ["0", "-0", "+1", "1e-3", ".5", "007", "1.50", '"2"', " 3 ", ""],
        ["0", "1", "+2", "-0", "18446744073709551615"],
    ],
)
@pytest.mark.parametrize("end", ["\n", "\r\n"])
def test_lines_that_stay_are_written_as_they_were(file, values, end) -> None:
    lines = ["\ufeffx,y,z, a b ", *(f"{value},{value},{value},{value}" for value in values)]
    scan = read(file, end.join(lines).encode())
    stay = np.arange(len(values)) % 3 != 1
    write_scan(file, scan.take(stay))
    kept = [line for line, stays in zip(lines[1:], stay, strict=True) if stays]
    assert file.read_bytes().decode() == "".join(line + end for line in [lines[0], *kept])
    write_scan(file, scan.take(np.array([2, 0])))
    assert file.read_bytes().decode().split(end) == [lines[0], lines[3], lines[1], ""]


def test_lines_whose_numbers_were_changed_are_written_anew(file) -> None:
    scan = read(file, "0.50 1 2 7\n3 4 5 8\n")
    fields = {**scan.fields, "intensity": np.array([7, 9])}
    write_scan(file, replace(scan, fields=fields))
    assert file.read_text() == "0.5 1 2 7\n3.0 4 5 9\n"
    write_scan(file, replace(scan, fields={**scan.fields, "ring": np.array([1, 2])}))
    assert file.read_text() == "x y z intensity ring\n0.5 1 2 7 1\n3.0 4 5 8 2\n"
    renamed = dict(zip(("x", "y", "z", "ring"), scan.fields.values(), strict=True))
    write_scan(file, replace(scan, fields=renamed))
    assert file.read_text() == "x y z ring\n0.5 1 2 7\n3.0 4 5 8\n"


NUMBERS = st.sampled_from(
    ["1", "-7", "0.5", "", str(2**63), str(-(2**63)), str(2**64 - 1), "9" * 25]
)


@given(st.lists(NUMBERS, min_size=1, max_size=5))
def test_how_many_lines_are_parsed_at_a_time_changes_nothing(texts) -> None:
    lines = "".join(f"{text},0,0,0\n" for text in ["1", *texts])
    content = Content(Path("scan.csv"), lines.encode(), MemoryBudget(0))
    whole = Table().decode(content, ("x", "y", "z", "i")).fields["x"]
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(table, "_CHUNK", 1)
        found = Table().decode(content, ("x", "y", "z", "i")).fields["x"]
    np.testing.assert_array_equal(found, whole, strict=True)
