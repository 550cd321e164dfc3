"""Scans as a program gives them become one source."""

from pathlib import Path

import numpy as np
import pytest

from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels
from derain.scan import Scan
from derain.sources.folders import source_of
from derain.sources.frame import MemoryFrame
from derain.sources.source import Frames


def test_scans_frames_and_paths_stand_in_the_order_they_are_given(tmp_path: Path) -> None:
    for number in range(2):
        scene(10 + number).tofile(tmp_path / f"{number}.bin")
        write_labels(tmp_path / f"{number}.label", np.arange(10 + number))
    scan = Scan.of(scene(30), "made")
    frame = MemoryFrame(key="framed", scan=Scan.of(scene(40)))
    source = source_of([scan, str(tmp_path), frame, tmp_path / "1.bin"])
    assert [len(each.read()) for each in source] == [30, 10, 11, 40, 11]
    assert [each.has_labels for each in source] == [False, True, True, False, True]
    np.testing.assert_array_equal(source[1].read_label(10), np.arange(10))


def test_one_scan_is_a_source_and_a_source_stays_what_it_is() -> None:
    scan = Scan.of(scene(30))
    assert [frame.read().xyz.shape for frame in source_of(scan)] == [(30, 3)]
    twice = source_of([scan, scan])
    assert [frame.key for frame in twice] == ["000000", "000001"]
    assert twice[1].follows(twice[0])
    source = Frames.of_scans([scan])
    assert source_of(source) is source


def test_wide_files_are_read_by_the_columns_that_are_named(tmp_path: Path) -> None:
    np.zeros((7, 5), "<f4").tofile(tmp_path / "wide.bin")
    (frame,) = source_of(tmp_path / "wide.bin", ["x", "y", "z", "intensity", "ring"])
    assert len(frame.read()) == 7


def test_what_is_no_scan_is_refused(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="scans: there are none"):
        source_of([])
    with pytest.raises(InputError, match="scans: dict is no scan"):
        source_of([{}])  # type: ignore[list-item]
    with pytest.raises(InputError, match="there is no such file"):
        source_of(tmp_path / "absent.bin")
