"""``derain run`` with a filter: the same files, numbers and errors as with a model."""

import json
from pathlib import Path

import numpy as np
import pytest

from derain.evaluation.hard_cases import hard_cases, scene
from derain.files import read_scan, write_scan
from derain.filters import DROR, DSOR, FILTERS, FilterDerainer, filter_from
from derain.scan import Scan


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    path = tmp_path / "scan.bin"
    scene(400).tofile(path)
    return path


def rain_in(out: Path) -> list[bool]:
    return np.fromfile(out / "scan.label", "<u4").astype(bool).tolist()


@pytest.mark.parametrize("name", FILTERS)
def test_a_scan_gets_its_labels_and_loses_its_rain(
    run_derain, scan: Path, tmp_path: Path, name: str
) -> None:
    out = tmp_path / "out"
    outcome = run_derain("run", name, scan, "--out", out, "--json", "--threads", "2")
    assert (outcome.code, outcome.said) == (0, [])
    rain = FilterDerainer(filter_from(name, {}))(scene(400))
    assert rain_in(out) == rain.tolist()
    assert (out / "scan.bin").read_bytes() == scene(400)[~rain].tobytes()
    item = json.loads(outcome.out)
    assert (item["points"], item["valid"], item["rain"]) == (400, 400, rain.sum())
    assert list(item["milliseconds"]) == ["read", "view", "network", "back", "weather", "write"]


def test_hard_scans_keep_every_row_that_is_not_rain(succeed, tmp_path: Path) -> None:
    for number, case in enumerate(case for _, case in hard_cases(largest=3000)):
        suffix = ".bin" if case.intensity is not None else ".pcd"
        write_scan(tmp_path / "scans" / f"{number:02d}{suffix}", case)
    succeed("run", "dror", tmp_path / "scans", "--out", tmp_path / "out")
    for path in (tmp_path / "scans").iterdir():
        before = read_scan(path)
        label = np.fromfile(tmp_path / "out" / f"{path.stem}.label", "<u4")
        assert label.shape == (len(before),)
        assert not label[~before.valid].any()
        after = read_scan(tmp_path / "out" / path.name)
        np.testing.assert_array_equal(after.xyz, before.xyz[label == 0])


def test_parameters_come_from_a_file_and_one_by_one(run_derain, scan: Path, tmp_path: Path) -> None:
    tuned, out = tmp_path / "best.yaml", tmp_path / "out"
    tuned.write_text("method: dsor\nneighbours: 4\nrange_multiplier: 0.02\n")
    run_derain("run", "dsor", scan, "--out", out, "--parameters", tuned)
    assert rain_in(out) == FilterDerainer(DSOR(4, 0.01, 0.02))(scene(400)).tolist()
    run_derain("run", tuned, scan, "--out", tmp_path / "same")
    assert rain_in(tmp_path / "same") == rain_in(out)
    options = ["--parameters", tuned, "--set", "range_multiplier=7e-2"]
    run_derain("run", "dsor", scan, "--out", out, *options, "--set", "deviation_multiplier=1")
    assert rain_in(out) == FilterDerainer(DSOR(4, 1.0, 0.07))(scene(400)).tolist()


def test_a_variant_is_set_by_its_name(run_derain, scan: Path, tmp_path: Path) -> None:
    out, wide = tmp_path / "out", {"azimuth_resolution": 1.0}
    options = ["--set", "variant=paper", "--set", "azimuth_resolution=1"]
    assert run_derain("run", "dror", scan, "--out", out, *options).code == 0
    paper, code = (FilterDerainer(DROR(variant=v, **wide))(scene(400)) for v in ("paper", "code"))
    assert rain_in(out) == paper.tolist() != code.tolist()


def test_a_missing_intensity_is_warned_of_once_and_only_where_it_is_needed(
    run_derain, succeed, tmp_path: Path
) -> None:
    for name in ("a", "b"):
        write_scan(tmp_path / "scans" / f"{name}.pcd", Scan(scene(100)[:, :3].copy()))
    arguments = [tmp_path / "scans", "--out", tmp_path / "out"]
    outcome = succeed("run", "ssr", *arguments)
    assert outcome.said == [
        f"derain: warning: {tmp_path / 'scans/a.pcd'}: no intensity: nothing can be found without",
        "derain: warning: 1 more scan: no intensity",
    ]
    assert run_derain("run", "dror", *arguments).said == []


@pytest.mark.parametrize(
    ("arguments", "reason"),
    [
        (["drorr"], "derain: drorr: no such file. Did you mean dror?"),
        (["ror", "--set", "radios=1"], "derain: ror: it has no parameter radios."),
        (["ror", "--set", "radius=wide"], "derain: ror: radius is 'wide'."),
        (["ror", "--set", "radius"], "--set: radius is not NAME=VALUE"),
        (["ror", "--set", "radius="], "--set: radius= is not NAME=VALUE"),
        (["ror", "--parameters", "none.yaml"], "derain: none.yaml: there is no such file."),
        (["ror", "--parameters", "dsor.yaml"], "derain: dsor.yaml: holds parameters of dsor"),
        (["dsor", "--parameters", "dsor.yaml"], "derain: dsor: it has no parameter limit."),
        (["{model}", "--set", "radius=1"], "it has no parameter radius."),
        (["{model}", "--set", "threshold=1.5"], "threshold is 1.5. Give a number from 0 to 1."),
        (["{model}", "--set", "threshold=high"], "threshold is high."),
    ],
)
def test_what_cannot_be_used_is_refused_before_any_work(
    refused,
    onnx_model: Path,
    scan: Path,
    monkeypatch: pytest.MonkeyPatch,
    arguments: list[str],
    reason: str,
) -> None:
    monkeypatch.chdir(scan.parent)
    Path("dsor.yaml").write_text("method: dsor\nlimit: 3\n")
    method, *options = (argument.format(model=onnx_model) for argument in arguments)
    assert reason in refused("run", method, "scan.bin", "--out", "out", *options)
    assert not Path("out").exists()


def test_parameters_of_a_model_are_its_own_however_its_file_is_named(
    succeed, onnx_model: Path, scan: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.chdir(scan.parent)
    Path("tuned.yaml").write_text(
        f"method: {onnx_model.parent}/../{onnx_model.parent.name}/{onnx_model.name}\nthreshold: 0\n"
    )
    succeed("run", onnx_model, scan, "--out", "out", "--parameters", "tuned.yaml")


def test_a_model_takes_a_threshold_of_its_own(
    run_derain, onnx_model: Path, scan: Path, tmp_path: Path
) -> None:
    from derain.export.runtime import Derainer

    probability = Derainer(onnx_model).probability(scene(400))
    threshold = float(np.quantile(probability, 0.9, method="lower"))
    tuned, out = tmp_path / "tuned.yaml", tmp_path / "out"
    tuned.write_text(f"method: {onnx_model}\nthreshold: {threshold}\n")
    assert run_derain("run", onnx_model, scan, "--out", out, "--parameters", tuned).code == 0
    assert rain_in(out) == (probability > threshold).tolist()
    assert 0 < sum(rain_in(out)) < (probability > 0.5).sum()
