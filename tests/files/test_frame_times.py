"""When scans were taken: lines of metadata.csv, found by name."""

from pathlib import Path

import pytest

from derain.errors import LONGEST_REASON, InputError
from derain.files.frame_times import read_frame_times


def written(folder: Path, text: str, *names: str) -> list[Path]:
    (folder / "metadata.csv").write_text(text)
    return [folder / name for name in names]


@pytest.mark.parametrize(
    ("lines", "names", "times"),
    [
        ("2,0.3\n0,0.1\n1,1700000000.25", ("0.bin", "1.bin", "2.bin"), [0.1, 1700000000.25, 0.3]),
        ("17.25,1\n17.5.pcd,2\n17,3", ("17.25.bin", "17.5.bin", "17.bin"), [1, 2, 3]),
        ("0,1\n0,1\n1,2", ("0.bin",), [1]),
        ("12,0.5\n000013.bin.gz,0.7", ("000012.bin.gz", "000013.bin"), [0.5, 0.7]),
    ],
    ids=["any order", "named by time", "the same line twice", "compressed"],
)
def test_a_scan_has_the_time_of_the_line_with_its_name(tmp_path, lines, names, times) -> None:
    scans = written(tmp_path, f"frame,timestamp\n{lines}\n", *names)
    assert read_frame_times(scans).tolist() == times


@pytest.mark.parametrize("frame", ["000012.bin", "12", "000012.pcd", " 12"])
def test_suffix_and_zeros_before_a_name_make_no_difference(tmp_path, frame) -> None:
    text = f"\ufefftimestamp,camera,frame\n5,1,{frame}\n6,1,0\n"
    scans = written(tmp_path, text, "000012.bin", "000000.bin")
    assert read_frame_times(scans).tolist() == [5, 6]


@pytest.mark.parametrize(
    ("text", "reason"),
    [
        ("frame,time\n0,1\n", r"has no columns frame and timestamp \(frame, time\)"),
        ("frame,timestamp\n1,1\n", r"has no line for 000000\.bin"),
        ("frame,timestamp\n0,soon\n", "cannot be read as .csv .*'soon'"),
        ("frame,timestamp\n0,nan\n", "cannot be read as .csv .*'0,nan'"),
        (f"frame,timestamp\n0,{'a' * 10**5}\n", "cannot be read as .csv .*'aaaa"),
        (f"frame,timestamp\n0,{'1' * 10**6}\n", "cannot be read as"),
        (f"frame,timestamp\n{'0,1' * 3 * 2**20}", "cannot be read as .csv .9,437,200 bytes"),
        ("frame,timestamp\n0\n", "cannot be read as .csv"),
        ("timestamp,frame\n1\n", "cannot be read as .csv .*',1'"),
        ("frame,timestamp\n0,1\n000.pcd,2\n", r"gives 000\.pcd two times"),
    ],
)
def test_what_holds_no_time_is_refused(tmp_path, text, reason) -> None:
    scans = written(tmp_path, text, "000000.bin")
    with pytest.raises(InputError, match=rf"metadata\.csv: {reason}") as refusal:
        read_frame_times(scans)
    assert len(str(refusal.value)) < len(str(tmp_path)) + LONGEST_REASON + 200


def test_a_missing_or_damaged_file_is_named(tmp_path) -> None:
    scans = [tmp_path / "0.bin"]
    with pytest.raises(InputError, match=r"metadata\.csv: there is no such file\. Write one"):
        read_frame_times(scans)
    (tmp_path / "metadata.csv").write_bytes(b"frame,timestamp\n\xff,1\n")
    with pytest.raises(InputError, match=r"metadata\.csv: cannot be read as \.csv"):
        read_frame_times(scans)
