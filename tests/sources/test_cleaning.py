"""``derain.clean``: what it writes, and what it reports of each scan and of all of them."""

from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_scenes

import derain
from derain.files.labels import read_labels
from derain.sources.cleaned_scan import ScanOutcome


def test_a_scan_that_cannot_be_read_is_reported_and_the_others_are_cleaned(tmp_path) -> None:
    scans, out = write_scenes(tmp_path / "scans", *3 * [200], name="{}.bin"), tmp_path / "out"
    (scans / "1.bin").write_bytes(b"broken")
    dror = derain.FilterDerainer(derain.DROR())
    outcomes: list[ScanOutcome] = []
    report = derain.clean(scans, dror, out, most_removed=1, watch=outcomes.append)
    names = [Path(outcome.frame.name).name for outcome in outcomes]
    assert names == ["0.bin", "1.bin", "2.bin"]
    assert [outcome.error is None for outcome in outcomes] == [True, False, True]
    assert [Path(str(error.subject)).name for error in report.failures] == ["1.bin"]
    assert str(report).startswith("2 scans, 1 not cleaned: 400 points")
    assert {path.name for path in out.iterdir()} == {"0.bin", "0.label", "2.bin", "2.label"}
    for scan in report.scans:
        path = Path(scan.scan)
        rain = read_labels(out / f"{path.stem}.label", scan.points)
        np.testing.assert_array_equal(rain, dror(derain.read_scan(path)))
        assert (scan.rain, len(derain.read_scan(out / path.name))) == (rain.sum(), 200 - rain.sum())


@pytest.mark.parametrize("given", ["dror", derain.DROR()])
def test_a_name_and_a_filter_alone_are_no_methods(tmp_path, given) -> None:
    scans = write_scenes(tmp_path / "scans", 200, name="{}.bin")
    with pytest.raises(derain.InputError, match=f"{type(given).__name__} is no method"):
        derain.clean(scans, given, tmp_path / "out")


@pytest.mark.parametrize("keeps", [False, True], ids=["without records", "with records"])
def test_results_among_the_recordings_are_none_to_a_later_run(tmp_path, keeps) -> None:
    drives = tmp_path / "drives"
    for name in "ab":
        write_scenes(drives / "monday" / name, 200, 200)
    source = derain.named_frames(drives)
    dror, division = derain.FilterDerainer(derain.DROR()), derain.Division(keep_records=keeps)
    with derain.CleanSink(drives / "out/clean", source, removed=drives / "out/rain") as sink:
        report = derain.clean(source, dror, sink, most_removed=1, division=division)
    assert len(report.scans) == 4
    later = [frame.name for frame in derain.named_frames(drives)]
    assert later == [frame.name for frame in source]


def test_a_folder_of_scans_is_not_marked_as_one_of_results(tmp_path) -> None:
    for name in "ab":
        write_scenes(tmp_path / name, 200)
    source = derain.named_frames(tmp_path)
    with derain.CleanSink(tmp_path / "a", source) as sink:
        derain.clean(source, derain.FilterDerainer(derain.DROR()), sink, most_removed=1)
    assert not (tmp_path / "a/.derain").exists()
