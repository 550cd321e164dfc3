"""``derain run``: labels for every row, cleaned scans with every field, and no scan harmed."""

import json
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
from numpy.typing import NDArray

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder of three scans of 100, 200 and 300 points."""
    folder = tmp_path / "scans"
    folder.mkdir()
    for number in (1, 2, 3):
        scene(100 * number, seed=number).tofile(folder / f"{number:06d}.bin")
    return folder


def labels(path: Path) -> NDArray[np.uint32]:
    return np.fromfile(path, "<u4")


def names(folder: Path) -> list[str]:
    """Every file below a folder, hidden ones included."""
    return sorted(str(f.relative_to(folder)) for f in folder.rglob("*") if f.is_file())


def test_a_scan_gets_its_labels_and_loses_its_rain(
    run_derain, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    scan, out = scans / "000003.bin", tmp_path / "out"
    outcome = run_derain("run", onnx_model, scan, "--out", out)
    assert (outcome.code, outcome.said) == (0, [])
    assert names(out) == ["000003.bin", "000003.label"]
    rain = Derainer(onnx_model)(scene(300, seed=3))
    assert 0 < rain.sum() < 300
    np.testing.assert_array_equal(labels(out / "000003.label"), rain)
    assert (out / "000003.bin").read_bytes() == scene(300, seed=3)[~rain].tobytes()
    counts = f"300 points, 300 valid, {rain.sum()} of rain ({rain.mean():.1%} of the valid), "
    assert outcome.out.startswith(f"{scan}: {counts}")


def test_a_folder_and_a_file_are_cleaned_together(
    succeed, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    single = tmp_path / "single.npy"
    np.save(single, scene(50))
    outcome = succeed("run", onnx_model, scans, single, "--out", tmp_path / "out")
    *lines, summary = outcome.out.splitlines()
    assert len(lines) == 4
    assert summary.startswith("4 scans: 650 points, ")
    rows = {path.stem: len(labels(path)) for path in (tmp_path / "out").glob("*.label")}
    assert rows == {"000001": 100, "000002": 200, "000003": 300, "single": 50}


def test_json_is_one_object_a_scan_and_nothing_else(
    succeed, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    points = scene(80)
    points[:7] = np.nan
    points.tofile(scans / "with_nan.bin")
    out = tmp_path / "out"
    outcome = succeed("run", onnx_model, scans, "--out", out, "--json")
    (summary,) = outcome.said
    objects = [json.loads(line) for line in outcome.out.splitlines()]
    assert [item["scan"] for item in objects] == [str(path) for path in sorted(scans.iterdir())]
    assert [item["points"] for item in objects] == [100, 200, 300, 80]
    assert [item["valid"] for item in objects] == [100, 200, 300, 73]
    rain, odd = sum(item["rain"] for item in objects), sum(bool(i["warnings"]) for i in objects)
    assert summary.startswith(
        f"4 scans: 680 points, 673 valid, {rain} of rain ({rain / 673:.1%} of the valid), "
    )
    assert summary.endswith(f"; {odd} scans with warnings")
    for item in objects:
        assert item["rain"] == labels(out / Path(item["scan"]).with_suffix(".label").name).sum()
        assert item["share_removed"] == item["rain"] / item["valid"]
        assert list(item["milliseconds"]) == ["read", "view", "network", "back", "weather", "write"]
        assert all(time >= 0 for time in item["milliseconds"].values())


def test_one_bad_scan_is_reported_and_the_rest_are_done(
    run_derain, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    bad = scans / "000002.bin"
    bad.write_bytes(bad.read_bytes()[:-5])
    outcome = run_derain("run", onnx_model, scans, "--out", tmp_path / "out", "--json")
    assert outcome.code == 2
    first, _, last = outcome.said
    assert first.startswith(f"derain: {bad}: 3195 bytes are not whole rows of 16 bytes")
    assert last == "derain: 1 of 3 scans could not be cleaned"
    assert [json.loads(line)["points"] for line in outcome.out.splitlines()] == [100, 300]
    assert names(tmp_path / "out") == [
        f"{stem}.{suffix}" for stem in ("000001", "000003") for suffix in ("bin", "label")
    ]


def test_a_folder_of_scans_is_not_overwritten(refused, onnx_model: Path, scans: Path) -> None:
    before = {path: path.read_bytes() for path in scans.iterdir()}
    line = refused("run", onnx_model, scans, "--out", scans.parent / "x" / ".." / "scans")
    assert "would overwrite" in line
    assert "Give --out another folder." in line
    assert {path: path.read_bytes() for path in scans.iterdir()} == before


def test_two_scans_of_one_name_are_refused(
    refused, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    np.save(tmp_path / "000001.npy", scene(10))
    out = tmp_path / "out"
    line = refused("run", onnx_model, scans, tmp_path / "000001.npy", "--out", out)
    assert "another scan has the same name" in line
    assert not out.exists()


def test_a_second_run_replaces_what_the_first_wrote(
    run_derain, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    run_derain("run", onnx_model, scans, "--out", out)
    first = {path: path.read_bytes() for path in out.iterdir()}
    assert run_derain("run", onnx_model, scans, "--out", out, "--threads", "1").code == 0
    assert {path: path.read_bytes() for path in out.iterdir()} == first


def test_the_intensity_scale_reaches_the_model_but_not_the_file(
    run_derain, onnx_model: Path, tmp_path: Path
) -> None:
    small = scene(300)
    small[:, 3] /= 256  # exact in binary, so that scaling gives the very same numbers back
    small.tofile(tmp_path / "small.bin")
    out = tmp_path / "out"
    arguments = ["run", onnx_model, tmp_path / "small.bin", "--out", out]
    outcome = run_derain(*arguments, "--intensity-scale", "256")
    assert (outcome.code, outcome.said) == (0, [])
    rain = labels(out / "small.label").astype(bool)
    np.testing.assert_array_equal(rain, Derainer(onnx_model)(scene(300)))
    assert (out / "small.bin").read_bytes() == small[~rain].tobytes()
    run_derain(*arguments)
    assert (labels(out / "small.label") != rain).any()


def test_intensities_of_another_unit_are_warned_of_once(
    run_derain, succeed, onnx_model: Path, tmp_path: Path
) -> None:
    for name in ("a", "b", "c"):
        points = scene(100)
        points[:, 3] /= 1000
        points.tofile(tmp_path / f"{name}.bin")
    outcome = succeed("run", onnx_model, tmp_path, "--out", tmp_path / "out")
    warning, more = outcome.said
    assert warning.startswith(f"derain: warning: {tmp_path / 'a.bin'}: mean intensity 0.0")
    assert "where the model was trained (unit 0..255): see --intensity-scale" in warning
    assert more == "derain: warning: 2 more scans: intensity of a smaller unit"
    scaled = run_derain(
        "run", onnx_model, tmp_path, "--out", tmp_path / "out", "--intensity-scale", "1000"
    )
    assert scaled.said == []


def test_a_model_that_was_trained_without_intensity_warns_of_none(
    run_derain, saying: Callable[..., Path], onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    spec = Derainer(onnx_model).metadata["spec"]
    model = saying({"spec": {**spec, "mean": [0.0] * 4}})
    outcome = run_derain("run", model, scans, "--out", tmp_path / "out")
    assert (outcome.code, outcome.said) == (0, [])


@pytest.mark.parametrize("out", ["file", "file/below"])
def test_nothing_is_left_where_the_output_cannot_be_written(
    run_derain, onnx_model: Path, scans: Path, tmp_path: Path, out: str
) -> None:
    (tmp_path / "file").write_text("in the way")
    before = names(tmp_path)
    outcome = run_derain("run", onnx_model, scans, "--out", tmp_path / out)
    assert outcome.code == 2
    *reports, last = outcome.said
    assert len(reports) == 3
    for number, report in enumerate(reports, start=1):
        assert f"{tmp_path / out / f'{number:06d}.bin'}: cannot be written" in report
    assert last == "derain: 3 of 3 scans could not be cleaned"
    assert outcome.out == ""
    assert names(tmp_path) == before
    assert (tmp_path / "file").read_text() == "in the way"


def test_labels_that_cannot_be_written_leave_no_temporary_file(
    run_derain, onnx_model: Path, scans: Path, tmp_path: Path
) -> None:
    out = tmp_path / "out"
    (out / "000001.label").mkdir(parents=True)
    outcome = run_derain("run", onnx_model, scans / "000001.bin", "--out", out)
    assert outcome.code == 2
    assert "000001.label: is not a file that can be replaced" in outcome.err
    assert names(out) == ["000001.bin"]


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["none.onnx", "scans", "--out", "out"], "derain: none.onnx: no such file."),
        (["notes", "scans", "--out", "out"], "derain: notes: not an ONNX"),
        (["{model}", "none", "--out", "out"], "derain: none: there is no such file or folder."),
        (["{model}", "empty", "--out", "out"], "derain: empty: holds no scans"),
        (["{model}", "scans", "--out", "out", "--threads", "-1"], "--threads: -1 is less than 0"),
        (["{model}", "scans", "--out", "o", "--intensity-scale", "nan"], "--intensity-scale: nan"),
        (["{model}", "scans", "--out", "o", "--intensity-scale", "0"], "--intensity-scale: 0 is"),
    ],
)
def test_what_cannot_be_used_is_refused_before_any_work(
    refused,
    onnx_model: Path,
    scans: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    reason: str,
) -> None:
    monkeypatch.chdir(scans.parent)
    Path("empty").mkdir()
    Path("notes").write_text("of no kind")
    assert reason in refused("run", *(argument.format(model=onnx_model) for argument in arguments))
    assert sorted(path.name for path in Path().iterdir()) == ["empty", "notes", "scans"]
