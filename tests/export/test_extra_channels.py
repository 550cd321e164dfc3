"""Networks trained on fused scans run on scans with the radar's columns and without them."""

from collections.abc import Callable
from pathlib import Path
from typing import Any

import lightning
import numpy as np
import onnx
import pytest
import torch
from numpy.typing import NDArray

from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.errors import InputError
from derain.evaluation.hard_cases import hard_cases, scene
from derain.export import onnx_file
from derain.export.onnx_file import export
from derain.export.runtime import Derainer
from derain.files import read_scan, write_scan
from derain.files.labels import read_labels, write_labels
from derain.models.base import DerainingModule
from derain.models.checkpoint import load_model
from derain.models.outdet import OutDet
from derain.models.salsanext import SalsaNext
from derain.scan import Scan

EXTRA = ("radar", "doppler", "rcs")
CARD = "name: fused\nclasses: {0: other, 3: rain}\nrain: [3]\n"
POINTS, DETECTIONS = 400, 40
NAMES = ("empty", "one point", "40 % duplicates", "NaN and infinite rows", "no intensity")
CASES = [(name, scan) for name, scan in hard_cases() if name in NAMES]


def fused(seed: int) -> Scan:
    """A scan whose last points are a radar's."""
    points, rng = scene(POINTS, seed), np.random.default_rng(seed)
    is_radar = np.arange(POINTS) >= POINTS - DETECTIONS
    measured = {"doppler": rng.normal(-2, 3, POINTS), "rcs": rng.normal(5, 8, POINTS)}
    columns: dict[str, NDArray[Any]] = dict(zip("xyz", points.T[:3], strict=True))
    columns |= {"intensity": points[:, 3], "radar": is_radar.astype(np.uint8)}
    columns |= {
        name: np.where(is_radar, column, np.nan).astype(np.float32)
        for name, column in measured.items()
    }
    return Scan(points[:, :3].copy(), points[:, 3].copy(), fields=columns)


@pytest.fixture(scope="module", params=["outdet", "salsanext"])
def trained(
    request: pytest.FixtureRequest,
    small_grid: dict[str, Any],
    tmp_path_factory: pytest.TempPathFactory,
) -> Path:
    """Checkpoint of a model that took a step on a fused scan."""
    folder = tmp_path_factory.mktemp(request.param)
    for number in range(2):
        write_scan(folder / f"{number}.npz", fused(number))
        write_labels(folder / f"{number}.label", np.arange(POINTS) % 4 // 3 * 3)
    (folder / "card.yaml").write_text(CARD)
    parts = {"train": ["*.npz"], "validation": ["*.npz"]}
    data = Folder(str(folder), str(folder / "card.yaml"), **parts, loading=Loading(batch_size=2))
    torch.manual_seed(0)
    model: DerainingModule
    if request.param == "outdet":
        model = OutDet(channels=("x", "y", "z", "intensity", *EXTRA))
    else:
        model = SalsaNext(small_grid, channels=(*EXTRA, "range", "z", "intensity"), width=4)
    trainer = lightning.Trainer(
        accelerator="cpu",
        max_epochs=1,
        logger=False,
        enable_checkpointing=False,
        enable_progress_bar=False,
        enable_model_summary=False,
    )
    trainer.fit(model, data)
    assert trainer.global_step == 1
    trainer.save_checkpoint(folder / "model.ckpt", weights_only=True)
    return folder / "model.ckpt"


@pytest.fixture(scope="module")
def derainer(trained: Path) -> Derainer:
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(onnx_file, "hard_cases", lambda: CASES)
        patch.setattr("derain.models.outdet.deployed.BLOCKS", 1)  # traced several times as quickly
        export(load_model(trained), trained.with_suffix(".onnx"))
    return Derainer(trained.with_suffix(".onnx"), threads=1)


def from_pytorch(checkpoint: Path, scan: Scan) -> NDArray[np.float32]:
    model = load_model(checkpoint)
    view = model.spec.make_view()(scan)
    with torch.inference_mode():
        logits = model(**{name: torch.from_numpy(a) for name, a in view.inputs().items()})
    return view.back(logits.softmax(dim=1)[:, 1].numpy())


def test_the_file_says_what_the_network_sees_and_in_what_units(
    trained: Path, derainer: Derainer
) -> None:
    spec = derainer.spec
    first = onnx.load(trained.with_suffix(".onnx")).graph.input[0].type.tensor_type.shape
    assert first.dim[1].dim_value == len(spec.channels)
    assert set(EXTRA) < set(spec.channels)
    units = dict(zip(spec.channels, spec.units, strict=True))
    assert [units[name] for name in EXTRA] == ["0 or 1", "m/s", "dBsm"]
    means = dict(zip(spec.channels, spec.mean, strict=True))
    assert means["radar"] == pytest.approx(DETECTIONS / POINTS)
    assert means["doppler"] == pytest.approx(-2, abs=1.5)


def test_an_extra_channel_that_is_normalised_wrongly_fails_the_proof(
    trained: Path, derainer: Derainer, monkeypatch: pytest.MonkeyPatch, tmp_path: Path
) -> None:
    wrong = load_model(trained)
    wrong.std[wrong.channels.index("doppler")] *= 2
    graph = onnx.load(trained.with_suffix(".onnx"))
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: graph)
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: CASES)
    with pytest.raises(InputError, match="the exported model differs"):
        export(wrong, tmp_path / "model.onnx")


@pytest.mark.parametrize("kept", [EXTRA, ("rcs",), ()], ids=["all", "one", "none"])
def test_a_scan_gets_the_answer_of_pytorch_whatever_columns_it_has(
    trained: Path, derainer: Derainer, kept: tuple[str, ...]
) -> None:
    whole = fused(7)
    columns = {name: whole.fields[name] for name in kept}
    scan = Scan(whole.xyz, whole.intensity, fields=columns)
    probability = derainer.probability(scan)
    assert probability.shape == (POINTS,)
    np.testing.assert_allclose(probability, from_pytorch(trained, scan), atol=1e-4)
    assert set(derainer.spec.missing_channels(scan)) == set(EXTRA) - set(kept)


def test_columns_make_a_difference_and_missing_ones_are_as_good_as_their_mean(
    derainer: Derainer,
) -> None:
    scan = fused(7)
    means = dict(zip(derainer.spec.channels, derainer.spec.mean, strict=True))
    filled = Scan(scan.xyz, scan.intensity, fields={n: np.full(POINTS, means[n]) for n in EXTRA})
    absent = derainer.probability(np.column_stack([scan.xyz, scan.intensity]))
    np.testing.assert_array_equal(derainer.probability(filled), absent)
    assert (derainer.probability(scan) != absent).mean() > 0.1


def test_scans_of_both_kinds_are_cleaned_with_every_column_kept(
    run_derain: Callable[..., Any], trained: Path, derainer: Derainer, tmp_path: Path
) -> None:
    scan = fused(7)
    write_scan(tmp_path / "in/fused.npz", scan)
    write_scan(tmp_path / "in/lidar.bin", Scan(scan.xyz, scan.intensity))
    model = trained.with_suffix(".onnx")
    outcome = run_derain("run", model, tmp_path / "in", "--out", tmp_path / "out", "--threads", "1")
    assert outcome.code == 0, outcome.err
    for name in ("fused.npz", "lidar.bin"):
        rain = derainer(read_scan(tmp_path / "in" / name))
        written = read_labels((tmp_path / "out" / name).with_suffix(".label"), POINTS)
        np.testing.assert_array_equal(written, rain)
    cleaned = read_scan(tmp_path / "out/fused.npz")
    assert set(cleaned.fields) == set(scan.fields)
