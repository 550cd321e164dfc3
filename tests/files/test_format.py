"""A format enters by being there: in derain, by a decorator, or named by another package."""

import importlib.util
import os
import re
import shutil
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest

from derain import InputError, Scan
from derain.cli.main import main
from derain.evaluation.hard_cases import scene
from derain.files import count_points, find_scans, read_scan, write_scan
from derain.files.format import FORMATS, Format, format_of
from derain.filters import FilterDerainer, filter_from

MODULE = Path(__file__).with_name("points_format.py")

# A filter calls much of a made-up scan rain.
RUN = ("run", "dror", "--most-removed", "1")

# What stands in the file of a wheel that names its entry points.
ENTRY_POINTS = "[derain.formats]\npoints = points_format\n"


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


@pytest.fixture
def installed(tmp_path: Path) -> Path:
    """A folder in which a package is installed that brings the format."""
    folder = tmp_path / "site-packages"
    metadata = folder / "points_format-1.0.dist-info"
    metadata.mkdir(parents=True)
    (metadata / "METADATA").write_text("Metadata-Version: 2.1\nName: points_format\nVersion: 1.0\n")
    (metadata / "entry_points.txt").write_text(ENTRY_POINTS)
    shutil.copy(MODULE, folder)
    return folder


def derain(*arguments: str | Path, path: Path) -> subprocess.CompletedProcess[str]:
    """The command in a process of its own that finds further packages in a folder."""
    code = "import sys; from derain.cli.main import main; sys.exit(main(sys.argv[1:]))"
    return subprocess.run(
        [sys.executable, "-c", code, *arguments],
        env={**os.environ, "PYTHONPATH": str(path)},
        capture_output=True,
        text=True,
    )


def assert_cleaned(file: Path, out: Path) -> None:
    """Whether DROR was run on the file: all points that are no rain are there, bit for bit."""
    rain = FilterDerainer(filter_from("dror", {}), threads=1)(Scan.of(scene(200)))
    assert 0 < rain.sum() < 200
    np.testing.assert_array_equal(np.fromfile(out / "scan.label", "<u4"), rain)
    kept = np.array(file.read_text().splitlines()[1:201])[~rain].tolist()
    assert (out / "scan.pts").read_text().splitlines() == [str(len(kept)), *kept]


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
    assert main([*RUN, str(file.parent), "--out", str(tmp_path / "out")]) == 0
    assert_cleaned(file, tmp_path / "out")
    assert "without its remarks" in capsys.readouterr().err
    with pytest.raises(InputError, match=r"Known are .*\.ply, \.pts, \.txt"):
        format_of(Path("scan.e57"))


def test_an_installed_format_is_known_to_the_commands(
    file: Path, installed: Path, tmp_path: Path
) -> None:
    run = derain(*RUN, file.parent, "--out", tmp_path / "out", path=installed)
    assert run.returncode == 0, run.stderr
    assert_cleaned(file, tmp_path / "out")
    assert "without its remarks" in run.stderr
    told = derain("info", "--formats", path=installed).stdout
    assert "  .pts                    points under a line with their number\n" in told


def test_help_says_which_files_do_not_name_their_columns(
    capsys: pytest.CaptureFixture[str],
) -> None:
    with pytest.raises(SystemExit):
        main(["run", "--help"])
    told = " ".join(capsys.readouterr().out.split())
    unnamed = ".bin, .npy, .npz of one array, text without a line of names"
    assert f"column names for files without them: {unnamed} (default: x,y,z,intensity)" in told


def test_the_formats_are_listed_with_what_they_need(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(SystemExit) as end:
        main(["info", "--formats"])
    assert end.value.code == 0
    told = capsys.readouterr().out
    assert all(suffix in told for suffix in FORMATS)
    assert re.search(r"^  \.las, \.laz +laser surveys \(needs derain\[las\]\)$", told, re.M)


@pytest.mark.parametrize("suffix", FORMATS)
def test_every_format_says_what_it_is(suffix: str) -> None:
    assert isinstance(format_of(Path(f"scan{suffix.upper()}.gz")), Format)
    assert suffix == suffix.lower()
    assert FORMATS[suffix].HELP
