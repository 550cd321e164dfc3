"""``derain run``: labels for every row, cleaned scans with every field, and no scan harmed."""

import json
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from recorded_scenes import write_scenes

import derain
from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.files import read_scan, write_scan
from derain.filters import DROR, DSOR, FilterDerainer
from derain.scan import Bools, Float32s, Ints, Scan
from derain.views.spherical_grid import SphericalGrid


@pytest.fixture
def scans(tmp_path) -> Path:
    """A folder of three scans of 100, 200 and 300 points."""
    return write_scenes(tmp_path / "scans", 100, 200, 300)


def rain_in(out: Path, stem: str = "scan") -> Bools:
    return np.fromfile(out / f"{stem}.label", "<u4").astype(bool)


def names(folder: Path) -> list[str]:
    """Every file below a folder, hidden ones included."""
    return sorted(str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file())


def test_scans_get_their_labels_and_lose_their_rain(succeed, onnx_model, scans, tmp_path) -> None:
    single, out = tmp_path / "single.npy", tmp_path / "out"
    np.save(single, scene(50))
    outcome = succeed("run", onnx_model, scans, single, "--out", out)
    assert outcome.messages == []
    kept = ["000000.bin", "000001.bin", "000002.bin", "single.npy"]
    assert names(out) == sorted([*kept, *(f"{Path(name).stem}.label" for name in kept)])
    rain = Derainer(onnx_model)(scene(300, seed=2))
    assert 0 < rain.sum() < 300
    np.testing.assert_array_equal(rain_in(out, "000002"), rain)
    assert (out / "000002.bin").read_bytes() == scene(300, seed=2)[~rain].tobytes()
    lines = outcome.out.splitlines()
    counts = f"300 points, 300 valid, {rain.sum()} of rain ({rain.mean():.1%} of the valid), "
    assert lines[2].startswith(f"{scans / '000002.bin'}: {counts}")
    assert lines[4].startswith("4 scans: 650 points, ")


def test_json_is_one_object_a_scan_and_nothing_else(succeed, onnx_model, scans, tmp_path) -> None:
    points = scene(80)
    points[:7] = np.nan
    points.tofile(scans / "with_nan.bin")
    out = tmp_path / "out"
    outcome = succeed("run", onnx_model, scans, "--out", out, "--json")
    (summary,) = outcome.messages
    objects = [json.loads(line) for line in outcome.out.splitlines()]
    assert [item["scan"] for item in objects] == [str(path) for path in sorted(scans.iterdir())]
    assert [item["points"] for item in objects] == [100, 200, 300, 80]
    assert [item["valid"] for item in objects] == [100, 200, 300, 73]
    rain, odd = sum(item["rain"] for item in objects), sum(bool(i["warnings"]) for i in objects)
    assert summary.startswith(f"4 scans: 680 points, 673 valid, {rain} of rain ({rain / 673:.1%}")
    assert summary.endswith(f"; {odd} scans with warnings")
    for item in objects:
        assert item["rain"] == rain_in(out, Path(item["scan"]).stem).sum()
        assert item["share_removed"] == item["rain"] / item["valid"]
        assert list(item["milliseconds"]) == ["read", "view", "network", "back", "weather", "write"]


@pytest.mark.parametrize(
    "command",
    [
        ["run", "ror", "{scans}", "--out", "out"],
        ["info", "{scans}"],
        ["view", "{scans}/000000.bin", "--methods", "ror", "--out", "out.png"],
    ],
    ids=lambda command: command[0],
)
def test_damaged_records_break_no_command_that_needs_none(succeed, scans, here, command) -> None:
    for record in ("poses.txt", "times.txt", "calib.txt", "scans/metadata.csv"):
        Path(record).write_bytes(b"\xff damaged")
    succeed(*(word.format(scans=scans) for word in command))


def test_nothing_is_left_where_the_output_cannot_be_written(
    refused, onnx_model, scans, tmp_path
) -> None:
    (tmp_path / "file").write_text("in the way")
    before = names(tmp_path)
    for option in (["--out"], ["--out", tmp_path / "out", "--removed"]):
        line = refused("run", onnx_model, scans, *option, tmp_path / "file/below")
        assert f"{tmp_path / 'file/below'}: cannot be written" in line
    assert names(tmp_path) == before


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["none.onnx", "scans"], "derain: none.onnx: no such method or file."),
        (["{model}", "scans", "--out", "scans"], "would overwrite scans/000000.bin. Give --out"),
        (["ror", "scans", "--parameters", "none.yaml"], "derain: none.yaml: there is no such"),
        (["ror", "scans", "--parameters", "dsor.yaml"], "dsor.yaml: holds parameters of dsor"),
        (["dsor", "scans", "--set", "limit=3"], "dsor: it has no parameter limit."),
        (["dror", "scans", "--probability"], "dror returns which points are rain, without prob"),
        (["{model}", "scans", "--probability"], "000000.bin: the columns of such a file have no"),
        (["dror", "scans", "--topic", "/points"], "no bag is named"),
        (["dror", "scans", "--poses", "none.txt"], "none.txt: "),
        (["dror", "scans", "--warning", "40", "30"], "Give two numbers of metres, the second"),
        (["dror", "scans", "--error", "35", "38"], "does not lie below the warning"),
        (["{model}", "scans", "--past", "51"], "--past: 51 is more than 50"),
    ],
)
def test_what_cannot_be_used_is_refused_before_any_work(
    refused, onnx_model, scans, monkeypatch, arguments, reason
) -> None:
    monkeypatch.chdir(scans.parent)
    Path("dsor.yaml").write_text("method: dsor\nneighbours: 3\n")
    words = [argument.format(model=onnx_model) for argument in arguments]
    out = [] if "--out" in words else ["--out", "out"]
    assert reason in refused("run", *words, *out)
    assert names(Path("scans")) == ["000000.bin", "000001.bin", "000002.bin"]
    assert not Path("out").exists()


def test_parameters_come_from_a_file_and_one_by_one(succeed, tmp_path) -> None:
    scan, tuned, out = tmp_path / "scan.bin", tmp_path / "best.yaml", tmp_path / "out"
    scene(400).tofile(scan)
    tuned.write_text("method: dsor\nneighbours: 4\nrange_multiplier: 0.02\n")

    def called(method: str | Path, *options: str | Path) -> list[bool]:
        succeed("run", method, scan, "--out", out, *options)
        return rain_in(out).tolist()

    of_file = FilterDerainer(DSOR(4, 0.01, 0.02))(scene(400)).tolist()
    assert called("dsor", "--parameters", tuned) == called(tuned) == of_file
    more = ["--set", "range_multiplier=7e-2", "--set", "deviation_multiplier=1"]
    expected = FilterDerainer(DSOR(4, 1.0, 0.07))(scene(400)).tolist()
    assert called("dsor", "--parameters", tuned, *more) == expected
    paper = FilterDerainer(DROR(variant="paper", azimuth_resolution=1.0))(scene(400)).tolist()
    assert called("dror", "--set", "variant=paper", "--set", "azimuth_resolution=1") == paper


@pytest.mark.parametrize("name", ["scan.npy", "scan.bin.gz"])
def test_a_file_without_names_of_columns_takes_no_probability(tmp_path, name) -> None:
    write_scan(tmp_path / name, scene(30))
    source = derain.named_frames(tmp_path / name)
    with pytest.raises(derain.InputError, match=r"scan\.\S+: .*have no names.*\.pcd or \.npz"):
        derain.CleanSink(tmp_path / "out", source, probability=True)


@pytest.mark.parametrize("suffix", [".pcd", ".npz", ".csv"])
def test_cleaned_and_removed_are_the_scan_with_the_probability_as_a_column(
    succeed, onnx_model, tmp_path, suffix
) -> None:
    path, out, removed = tmp_path / f"scan{suffix}", tmp_path / "out", tmp_path / "removed"
    columns = dict(zip(("x", "y", "z", "intensity"), scene(300).T, strict=True))
    columns["ring"] = np.arange(300, dtype=np.uint16)
    columns["rain_probability"] = np.full(300, 7.0)  # as of an earlier run
    write_scan(path, replace(Scan.of(scene(300)), fields=columns))
    scan = read_scan(path)
    probability = Derainer(onnx_model).probability(scan)
    options = ("--out", out, "--removed", removed, "--probability")
    assert succeed("run", onnx_model, path, *options).messages == []
    rain = rain_in(out)
    assert 0 < rain.sum() < 300
    assert [file.name for file in removed.iterdir()] == [path.name]
    for file, rows in ((out / path.name, ~rain), (removed / path.name, rain)):
        part = read_scan(file)
        assert {*part.fields} == {*scan.fields}
        column = part.fields.pop("rain_probability")
        np.testing.assert_array_equal(column.astype(np.float32), probability[rows])
        for name, values in part.fields.items():
            np.testing.assert_array_equal(values, scan.fields[name][rows], strict=True)


def test_a_scan_that_would_lose_too_much_is_left_whole(run_derain, tmp_path, scans) -> None:
    spread = scene(200) * np.array([1e3, 1e3, 1e3, 1], np.float32)
    spread.tofile(scans / "000001.bin")
    out = tmp_path / "out"
    options = ("--set", "radius=20", "--most-removed", "0.99")
    outcome = run_derain("run", "ror", scans, "--out", out, *options)
    assert outcome.code == 2
    refused, summary = outcome.err.splitlines()[-2:]
    assert refused.startswith(f"derain: {scans / '000001.bin'}: left whole: 100.0% of its valid")
    assert summary == "derain: 1 of 3 scans could not be cleaned"
    assert {path.stem for path in out.iterdir()} == {"000000", "000002"}


def test_a_scan_is_projected_once_and_points_outside_the_grid_are_warned_of(
    succeed, salsanext_onnx, tmp_path, monkeypatch
) -> None:
    points = scene(400)
    points[:100, 2] = 80.0  # above the grid
    points.tofile(tmp_path / "scan.bin")
    projected, pixel = [], SphericalGrid.pixel

    def counting(grid: SphericalGrid, xyz: Float32s) -> Ints:
        projected.append(len(xyz))
        return pixel(grid, xyz)

    monkeypatch.setattr(SphericalGrid, "pixel", counting)
    outcome = succeed("run", salsanext_onnx, tmp_path / "scan.bin", "--out", tmp_path / "out")
    assert [points for points in projected if points] == [400]  # of none when a model is opened
    outside = (Derainer(salsanext_onnx).view.grid.pixel(points[:, :3]) < 0).mean()
    (warning,) = outcome.messages
    assert f"{tmp_path / 'scan.bin'}: {outside:.0%} of the points lie outside the grid" in warning
