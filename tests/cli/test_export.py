"""``derain export``: a checkpoint in, a proved and timed ONNX file out, or one line."""

from collections.abc import Collection
from pathlib import Path

import numpy as np
import onnx
import pytest

from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.runtime import Derainer
from derain.export.runtimes.session import Runtime
from derain.files import read_scan
from derain.models.base import DerainingModule
from derain.models.checkpoint import save_model
from derain.scan import Scan


@pytest.mark.usefixtures("one_block")
def test_a_checkpoint_becomes_a_model_with_its_proof_and_times(
    succeed, checkpoint: Path, onnx_model: Path, tmp_path: Path
) -> None:
    scan, out = tmp_path / "scan.bin", tmp_path / "new" / "outdet.onnx"
    scene(500).tofile(scan)
    outcome = succeed(
        *("export", checkpoint, "--out", out), *("--scan", scan, "--threads", "1", "--repeats", "3")
    )
    assert "48 cases" in outcome.out
    assert "0 labels flipped" in outcome.out
    assert f"Wrote {out} ({out.stat().st_size:,} bytes)" in outcome.out
    assert "500 points, 1 threads, 3 runs, milliseconds" in outcome.out
    for stage in ("read", "view", "network", "back", "total"):
        assert f"\n{stage} " in outcome.out
    assert [path.name for path in out.parent.iterdir()] == ["outdet.onnx"]
    first, second = Derainer(onnx_model), Derainer(out)
    assert first.spec == second.spec
    np.testing.assert_allclose(
        first.probability(scene()), second.probability(scene()), rtol=0, atol=1e-6
    )


@pytest.mark.usefixtures("one_block")
def test_candidates_are_fitted_to_labelled_scans_and_their_cost_is_said(
    run_derain, succeed, checkpoint: Path, onnx_model: Path, write_labelled, tmp_path: Path
) -> None:
    for number in range(2):
        stem = tmp_path / "scans" / str(number)
        write_labelled(stem.with_suffix(".bin"), stem.with_suffix(".label"), rain=110)
    options = ["--candidates", tmp_path / "scans", "--card", "wads", "--inside", "0.9"]
    out = tmp_path / "candidates.onnx"
    outcome = succeed("export", checkpoint, "--out", out, *options, "--repeats", "1")
    derainer, of_all = Derainer(out, 1), Derainer(onnx_model, 1)
    candidates = derainer.spec.candidates
    assert candidates is not None
    assert f"Candidates: {candidates}, " in outcome.out
    assert "% of that which the network finds\nIoU on these 2 scans 0." in outcome.out
    for path in sorted((tmp_path / "scans").glob("*.bin")):
        scan = read_scan(path)
        expected = of_all(scan) & candidates.among(scan)
        np.testing.assert_array_equal(derainer(scan), expected)
    told = run_derain("info", out)
    assert f"candidates: {candidates}" in told.out
    assert "candidates: every point" in run_derain("info", onnx_model).out


def test_scans_that_candidates_are_fitted_to_count_once_and_are_warned_of(
    run_derain, checkpoint: Path, write_labelled, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    monkeypatch.setattr(onnx_file, "export", lambda _, path, *__: path.touch())
    monkeypatch.setattr("derain.export.timing.measure_latency", lambda *_: "times")
    scan, label = tmp_path / "scans/0.bin", tmp_path / "scans/0.label"
    write_labelled(scan, label, rain=110)
    options = ["--candidates", scan, "--card", "wads", "--inside", "0.9"]
    command = ["export", checkpoint, "--out", tmp_path / "outdet.onnx", *options]
    once = run_derain(*command)
    assert once.said == []
    # As a sensor writes them that tells two returns of every beam; WADS counts them once.
    points, labels = np.fromfile(scan, np.float32), np.fromfile(label, np.uint32)
    twice = np.concatenate([points.reshape(-1, 4), points.reshape(-1, 4)[:200]])
    twice.tofile(scan)
    np.concatenate([labels, labels[:200]]).tofile(label)
    assert run_derain(*command).out == once.out
    (twice / np.array([1, 1, 1, 256], np.float32)).tofile(scan)
    (warning,) = run_derain(*command).said
    assert warning.startswith(f"derain: warning: {scan}: mean intensity 0.")
    scaled = run_derain(*command, "--intensity-scale", "256")
    assert (scaled.said, scaled.out) == ([], once.out)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        (
            ["--inside", "0.99"],
            "--inside: bounds candidates, and there are none. Give --candidates",
        ),
        (["--candidates", "scans"], "nothing in it says which labels are rain"),
        (["--candidates", "scans", "--card", "wads"], "0.bin: its labels are not at"),
        (["--candidates", "nowhere", "--card", "wads"], "nowhere: "),
    ],
    ids=["no candidates", "no card", "no labels", "no scans"],
)
def test_candidates_need_labelled_scans(
    refused,
    checkpoint: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
    message: str,
) -> None:
    (tmp_path / "scans").mkdir()
    scene(50).tofile(tmp_path / "scans/0.bin")
    monkeypatch.chdir(tmp_path)
    assert message in refused("export", checkpoint, "--out", "model.onnx", *options)
    assert not (tmp_path / "model.onnx").exists()


@pytest.fixture
def scans(tmp_path: Path) -> Path:
    """A folder of twenty scenes, more than eight bits are scaled by."""
    (tmp_path / "scans").mkdir()
    for seed in range(20):
        scene(500, seed).tofile(tmp_path / "scans" / f"{seed:02d}.bin")
    return tmp_path / "scans"


def test_a_model_in_eight_bits_is_scaled_by_scans_like_those_it_will_see(
    succeed,
    random_salsanext: DerainingModule,
    salsanext_onnx: Path,
    scans: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(salsanext_onnx))
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(100)))])
    save_model(random_salsanext, tmp_path / "model.ckpt")
    outcome = succeed(
        *("export", tmp_path / "model.ckpt", "--out", tmp_path / "int8.onnx"),
        *("--int8", "--calibration", scans, "--scan", scans / "00.bin", "--repeats", "1"),
    )
    # Sixteen of the scans and the scene, each with one thread and with two.
    assert "34 cases" in outcome.out
    int8 = Derainer(tmp_path / "int8.onnx")
    names = {case["name"] for case in int8.metadata["proof"]["cases"]}
    assert names - {"scene"} < {str(path) for path in scans.iterdir()}
    assert len(names) == 17
    operators = {node.op_type for node in onnx.load(tmp_path / "int8.onnx").graph.node}
    assert {"QuantizeLinear", "DequantizeLinear"} <= operators


def test_calibration_scans_of_another_unit_are_warned_of_once_and_scaled(
    run_derain,
    random_salsanext: DerainingModule,
    scans: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    brightest = []

    def export(
        model: DerainingModule, path: Path, calibration: Collection[Scan], runtime: Runtime
    ) -> str:
        path.touch()
        brightest[:] = [scan.intensity.max() for scan in [*calibration, *calibration]]
        return "proof"

    monkeypatch.setattr(onnx_file, "export", export)
    monkeypatch.setattr("derain.export.timing.measure_latency", lambda *_: "times")
    save_model(random_salsanext, tmp_path / "model.ckpt")
    options = ["--out", tmp_path / "int8.onnx", "--int8", "--calibration", scans]
    assert run_derain("export", tmp_path / "model.ckpt", *options).said == []
    whole = brightest.copy()
    for scan in scans.iterdir():
        points = np.fromfile(scan, np.float32).reshape(-1, 4)
        (points / np.array([1, 1, 1, 256], np.float32)).tofile(scan)
    first, more = run_derain("export", tmp_path / "model.ckpt", *options).said
    assert first.startswith(f"derain: warning: {scans / '00.bin'}: mean intensity 0.")
    assert "see --intensity-scale" in first
    assert more == "derain: warning: 15 more scans: intensity of a smaller unit"
    assert max(brightest) < 1 < max(whole)
    scaled = run_derain("export", tmp_path / "model.ckpt", *options, "--intensity-scale", "256")
    assert scaled.said == []
    assert brightest == whole
    assert len(whole) == 32


@pytest.mark.parametrize("options", [["--int8"], ["--calibration", "scans"]], ids=str)
def test_eight_bits_and_calibration_scans_come_together(
    refused,
    checkpoint: Path,
    scans: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    options: list[str],
) -> None:
    monkeypatch.chdir(tmp_path)
    line = refused("export", checkpoint, "--out", "model.onnx", *options)
    assert line == "derain: --int8: needs --calibration, and that needs it. Give both or neither."
    assert list(tmp_path.iterdir()) == [scans]


@pytest.mark.parametrize(
    ("calibration", "reason"),
    [("none", "none"), ("empty", "empty"), ("scans", "no convolution to quantise")],
)
def test_what_cannot_be_computed_in_eight_bits_is_one_line_and_exit_code_2(
    refused,
    checkpoint: Path,
    onnx_model: Path,
    scans: Path,
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    calibration: str,
    reason: str,
) -> None:
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(onnx_model))
    (tmp_path / "empty").mkdir()
    options = ["--int8", "--calibration", calibration]
    assert reason in refused("export", checkpoint, "--out", "model.onnx", *options)
    assert sorted(path.name for path in tmp_path.iterdir()) == ["empty", "scans"]


@pytest.mark.parametrize("option", [("--repeats", "0"), ("--threads", "-2")])
def test_impossible_options_are_refused_before_any_work(
    refused, checkpoint: Path, tmp_path: Path, option: tuple[str, str]
) -> None:
    line = refused("export", checkpoint, "--out", tmp_path / "model.onnx", *option)
    assert f"{option[0]}: {option[1]} is less than" in line
    assert list(tmp_path.iterdir()) == []


def test_a_checkpoint_that_is_not_there_is_one_line_and_exit_code_2(
    refused, tmp_path: Path
) -> None:
    line = refused("export", tmp_path / "none.ckpt", "--out", tmp_path / "model.onnx")
    assert f"{tmp_path / 'none.ckpt'}: there is no such file" in line
    assert list(tmp_path.iterdir()) == []
