"""A format enters by being there: in derain, by a decorator, or named by another package."""

import importlib.util
import re
from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan
from derain.cli.main import main
from derain.evaluation.hard_cases import scene
from derain.files import count_points, find_scans, read_scan, write_scan
from derain.files.format import FORMATS, format_of
from derain.filters import FilterDerainer, filter_from

ALL = ("--most-removed", "1")  # a filter calls much of a made-up scan rain
MODULE = Path(__file__).with_name("points_format.py")


@pytest.fixture
def file(tmp_path: Path) -> Path:
    """A scan of 200 points in the format from outside, and a remark behind it."""
    lines = "".join(f"{' '.join(map(repr, row))}\n" for row in scene(200).tolist())
    path = tmp_path / "scans" / "scan.pts"
    path.parent.mkdir()
    path.write_text(f"200\n{lines}# measured in the yard\n")
    return path


@pytest.fixture
def _decorated(monkeypatch: pytest.MonkeyPatch) -> None:
    """The format is known until the test ends."""
    monkeypatch.setattr(FORMATS, "_members", {suffix: FORMATS[suffix] for suffix in FORMATS})
    spec = importlib.util.spec_from_file_location("points_format", MODULE)
    assert spec is not None
    assert spec.loader is not None
    spec.loader.exec_module(importlib.util.module_from_spec(spec))


@pytest.mark.usefixtures("_decorated")
def test_a_decorated_format_is_read_written_found_and_cleaned(
    file: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    scan = read_scan(file)
    np.testing.assert_array_equal(scan.xyz, scene(200)[:, :3])
    assert count_points(file) == 200
    for name in ("copy.pts", "copy.PTS.gz"):
        write_scan(file.with_name(name), scan)
        assert read_scan(file.with_name(name)).fields.keys() == scan.fields.keys()
        np.testing.assert_array_equal(read_scan(file.with_name(name)).xyz, scan.xyz)
        file.with_name(name).unlink()
    assert find_scans([file.parent]) == [file]
    with pytest.raises(InputError, match=r"holds x, y, z and intensity alone"):
        write_scan(file, Scan(scan.xyz))
    assert main(["run", "dror", str(file.parent), "--out", str(tmp_path / "out"), *ALL]) == 0
    rain = FilterDerainer(filter_from("dror", {}), threads=1)(Scan.of(scene(200)))
    assert 0 < rain.sum() < 200
    np.testing.assert_array_equal(np.fromfile(tmp_path / "out/scan.label", "<u4"), rain)
    kept = np.array(file.read_text().splitlines()[1:201])[~rain].tolist()
    assert (tmp_path / "out/scan.pts").read_text().splitlines() == [str(len(kept)), *kept]
    assert "without its remarks" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"Known are .*\.ply, \.pts, \.txt"):
        format_of(Path("scan.e57"))


def test_commands_list_the_formats_what_they_need_and_which_do_not_name_their_columns(
    run_derain,
) -> None:
    told = run_derain("info", "--formats").out
    assert all(suffix in told and FORMATS[suffix].HELP in told for suffix in FORMATS)
    assert re.search(r"^  \.las, \.laz +laser surveys \(needs derain\[las\]\)$", told, re.M)
    help_of_run = " ".join(run_derain("run", "--help-all").out.split())
    assert ".bin, .npy, .npz of one array, text without a line of names" in help_of_run
