"""Whoever follows the contract, as the reader in NumPy does, calls rain what derain calls rain."""

import re
import subprocess
import sys
from collections.abc import Iterator
from dataclasses import fields, replace
from importlib import import_module
from pathlib import Path
from types import ModuleType

import numpy as np
import onnx
import pytest

from derain.default import default_model
from derain.evaluation.hard_cases import scene
from derain.export.onnx_file import with_metadata
from derain.export.runtime import Derainer
from derain.scan import Float32s
from derain.spec import Spec
from derain.views.back_projection import BACK_PROJECTIONS
from derain.views.view import VIEWS

from .hard_points import KEPT, SCANS

REPOSITORY = Path(__file__).resolve().parents[2]
EXAMPLE = REPOSITORY / "examples" / "onnx_reader.py"
CONTRACT = (REPOSITORY / "docs" / "onnx_contract.md").read_text("utf-8")


@pytest.fixture(scope="module")
def reader() -> Iterator[ModuleType]:
    """The example's module."""
    with pytest.MonkeyPatch.context() as patch:
        patch.syspath_prepend(EXAMPLE.parent)
        yield import_module("onnx_reader")
        del sys.modules["onnx_reader"]


def agree(reader: ModuleType, path: Path, *scans: Float32s) -> None:
    """Judges scans by the reader and by derain, and compares the answers."""
    theirs, ours = reader.Model(str(path)), Derainer(path, threads=1)
    for points in scans:
        judgement = ours.judge(points)
        np.testing.assert_allclose(theirs.judge(points), judgement.probability, rtol=0, atol=1e-6)
        np.testing.assert_array_equal(theirs.rain(points), judgement.rain)


def test_of_neighbours_it_makes_what_derain_makes(reader, judging_candidates) -> None:
    for model in (default_model(), judging_candidates, KEPT):  # the last of an early derain
        agree(reader, model, *SCANS.values())
    hard = SCANS["ties, copies, invalid rows"]
    assert 0 < Derainer(default_model(), threads=1)(hard).mean() < 0.9


def test_of_images_it_makes_what_derain_makes_whichever_way_scores_come_back(
    reader, model_of_images
) -> None:
    agree(reader, model_of_images, *SCANS.values(), scene(400))


@pytest.mark.parametrize(
    "change",
    [{"channels": ("x", "y", "dual_return")}, {"view": {"kind": "voxels"}}],
    ids=["a former channel", "another view"],
)
def test_what_it_does_not_know_is_refused(reader, tmp_path, change) -> None:
    spec = replace(Derainer(default_model(), threads=1).spec, **change)
    model = with_metadata(onnx.load(default_model()), {"spec": spec.as_dict()})
    (tmp_path / "model.onnx").write_bytes(model)
    with pytest.raises(SystemExit, match="asks for what this reader does not know"):
        reader.Model(str(tmp_path / "model.onnx"))


@pytest.mark.parametrize("text", [b'"numpy"', b'"sha256"'], ids=["versions", "checksum"])
def test_a_model_that_has_changed_is_refused(reader, tmp_path, text) -> None:
    model = tmp_path / "model.onnx"
    model.write_bytes(default_model().read_bytes().replace(text, text.upper()))
    with pytest.raises(SystemExit, match="its checksum differs or is missing"):
        reader.Model(str(model))


def test_from_the_command_line_it_writes_labels(tmp_path) -> None:
    points = scene(300)
    points.tofile(tmp_path / "scan.bin")
    command = [sys.executable, EXAMPLE, default_model(), "scan.bin", "scan.label"]
    subprocess.run(command, cwd=tmp_path, check=True)
    label = np.fromfile(tmp_path / "scan.label", "<u4")
    np.testing.assert_array_equal(label, Derainer(threads=1)(points))


def test_it_needs_nothing_of_derain() -> None:
    imported = re.findall(r"^(?:import|from) (\w+)", EXAMPLE.read_text("utf-8"), re.MULTILINE)
    beyond = {"hashlib", "json", "math", "pathlib", "sys", "typing", "numpy", "onnxruntime"}
    assert set(imported) <= beyond


def test_the_contract_names_all_that_a_file_may_hold() -> None:
    named = set(re.findall(r"`([^`]+)`", CONTRACT))
    assert {one.name for one in fields(Spec)} <= named
    assert {f'"kind": "{view}"' in CONTRACT for view in VIEWS} == {True}
    assert {f'"{way}":' in CONTRACT for way in BACK_PROJECTIONS} == {True}
    assert set(Derainer().metadata) <= named
