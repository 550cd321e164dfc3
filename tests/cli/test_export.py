"""``derain export``: a checkpoint in, a proved and timed ONNX file out, or one line."""

import shutil
from pathlib import Path

import numpy as np
import onnx
import pytest

from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.runtime import Derainer
from derain.files import read_scan
from derain.models.base import DerainingModule
from derain.models.checkpoint import save_model


@pytest.mark.usefixtures("one_block")
def test_a_checkpoint_becomes_a_model_with_its_proof_and_times(
    succeed, checkpoint, onnx_model, tmp_path
) -> None:
    scan, out = tmp_path / "scan.bin", tmp_path / "new" / "outdet.onnx"
    scene(500).tofile(scan)
    timed = ("--scan", scan, "--threads", "1", "--repeats", "3")
    outcome = succeed("export", checkpoint, "--out", out, *timed)
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


def test_the_model_that_comes_with_derain_is_exported_by_its_name(
    succeed, here, monkeypatch
) -> None:
    exported = []

    def keep(model: DerainingModule, path: Path, *_: object) -> None:
        exported.append(model.spec)
        path.touch()

    monkeypatch.setattr(onnx_file, "export", keep)
    monkeypatch.setattr("derain.export.timing.measure_latency", lambda *_: "times")
    succeed("export", "default", "--out", "model.onnx")
    assert exported == [Derainer().spec]


def test_an_exported_model_is_not_exported_again_as_the_checkpoint_beside_it(
    refused, checkpoint, onnx_model, here
) -> None:
    shutil.copy(checkpoint, "model.ckpt")
    shutil.copy(onnx_model, "model.onnx")
    assert "model.onnx: " in refused("export", "model.onnx", "--out", "again.onnx")
    assert not Path("again.onnx").exists()


@pytest.fixture
def scans(here, write_labelled) -> Path:
    """A folder of twenty labelled scans, more than eight bits are scaled by."""
    for number in range(20):
        stem = here / f"scans/{number:02}"
        write_labelled(stem.with_suffix(".bin"), stem.with_suffix(".label"), rain=110)
    return here / "scans"


@pytest.mark.usefixtures("one_block", "short_proof")
def test_candidates_are_fitted_to_labelled_scans_and_their_cost_is_printed(
    succeed, checkpoint, onnx_model, scans, tmp_path, monkeypatch
) -> None:
    out, few = tmp_path / "candidates.onnx", sorted(scans.glob("*.bin"))[:2]
    options = ["--candidates", *few, "--card", "wads"]
    outcome = succeed("export", checkpoint, "--out", out, *options, "--repeats", "1")
    derainer, of_all = Derainer(out, 1), Derainer(onnx_model, 1)
    candidates = derainer.spec.candidates
    assert f"Candidates: {candidates}, " in outcome.out
    assert "% of that which the network finds\nIoU on 2 scans 0." in outcome.out
    for scan in map(read_scan, few):
        np.testing.assert_array_equal(derainer(scan), of_all(scan) & candidates.among(scan))
    assert f"candidates: {candidates}" in succeed("info", out).out
    assert "candidates: every point" in succeed("info", onnx_model).out


def test_scans_that_candidates_are_fitted_to_count_once_and_are_warned_of(
    run_derain, checkpoint, scans, monkeypatch
) -> None:
    monkeypatch.setattr(onnx_file, "export", lambda model, path, *_: path.touch())
    monkeypatch.setattr("derain.export.timing.measure_latency", lambda *_: "times")
    scan, label = scans / "00.bin", scans / "00.label"
    options = ["--candidates", scan, "--card", "wads"]
    command = ["export", checkpoint, "--out", "outdet.onnx", *options]
    once = run_derain(*command)
    assert once.messages == []
    # As a sensor of two returns writes them; WADS counts them once.
    points, labels = np.fromfile(scan, np.float32), np.fromfile(label, np.uint32)
    twice = np.concatenate([points.reshape(-1, 4), points.reshape(-1, 4)[:200]])
    twice.tofile(scan)
    np.concatenate([labels, labels[:200]]).tofile(label)
    assert run_derain(*command).out == once.out
    (twice / np.array([1, 1, 1, 256], np.float32)).tofile(scan)
    (warning,) = run_derain(*command).messages
    assert warning.startswith(f"derain: warning: {scan}: mean intensity 0.")
    scaled = run_derain(*command, "--intensity-scale", "256")
    assert (scaled.messages, scaled.out) == ([], once.out)


@pytest.mark.usefixtures("short_proof")
def test_a_model_in_eight_bits_is_scaled_by_scans_like_those_it_will_see(
    succeed, random_salsanext, salsanext_onnx, scans, monkeypatch
) -> None:
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(salsanext_onnx))
    save_model(random_salsanext, Path("model.ckpt"))
    options = ["--int8", "--calibration", scans, "--scan", scans / "00.bin", "--repeats", "1"]
    outcome = succeed("export", "model.ckpt", "--out", "int8.onnx", *options)
    # Sixteen of the scans and the scene, each with one thread and with two.
    assert "34 cases" in outcome.out
    names = {case["name"] for case in Derainer("int8.onnx").metadata["proof"]["cases"]}
    assert names - {"scene"} < {str(path) for path in scans.iterdir()}
    assert len(names) == 17
    operators = {node.op_type for node in onnx.load("int8.onnx").graph.node}
    assert {"QuantizeLinear", "DequantizeLinear"} <= operators


@pytest.mark.parametrize(
    ("options", "reason"),
    [
        (["--int8"], "--int8: needs --calibration, and that needs it. Give both or neither."),
        (["--calibration", "scans"], "--int8: needs --calibration, and that needs it."),
        (["--int8", "--calibration", "none"], "none: "),
        (["--int8", "--calibration", "empty"], "empty: "),
        (["--int8", "--calibration", "scans"], "no convolution to quantise"),
        (["--candidates", "scans"], "nothing in it shows which labels are rain"),
        (["--candidates", "bare.bin", "--card", "wads"], "bare.bin: its labels are not at"),
        (["--candidates", "none", "--card", "wads"], "none: "),
        (["--scan", "none.bin"], "none.bin: there is no such file"),
    ],
)
def test_what_cannot_be_exported_is_one_line_and_leaves_no_file(
    refused, checkpoint, onnx_model, scans, monkeypatch, options, reason
) -> None:
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(onnx_model))
    Path("empty").mkdir()
    scene(50).tofile("bare.bin")
    assert reason in refused("export", checkpoint, "--out", "model.onnx", *options)
    assert {path.name for path in Path().iterdir()} == {"bare.bin", "empty", "scans"}
