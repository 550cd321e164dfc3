"""A runtime is found by its name, opens what has been looked at, and is refused in one line."""

import os
import platform
import sys
from pathlib import Path
from typing import Any

import numpy as np
import onnx
import onnxruntime
import pytest
from onnxruntime.capi.onnxruntime_pybind11_state import NotImplemented as NoKernel

import derain
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export import onnx_file
from derain.export.methods import load_method
from derain.export.model_file import ModelFile
from derain.export.runtime import Derainer
from derain.export.runtimes.onnx_runtime import WRONG_FUSION
from derain.export.runtimes.session import RUNTIMES, Runtime, TensorType
from derain.export.timing import versions
from derain.models.checkpoint import load_model
from derain.scan import Scan

KEPT = Path(__file__).parent.parent / "kept/outdet.onnx"
SCORES = [TensorType("float32", (None, 2))]
INPUTS = {
    "points": TensorType("float32", (None, 4)),
    "distances": TensorType("float32", (None, 3)),
    "neighbours": TensorType("int64", (None, 3)),
}


def test_onnxruntime_in_float32_is_what_runs_a_model_unless_another_is_named() -> None:
    assert Derainer(KEPT, 1).runtime == Runtime("onnxruntime", "float32")
    assert Runtime().is_default
    assert {"onnxruntime", "openvino"} <= set(RUNTIMES)
    assert os.environ["ORT_DISABLE_TELEMETRY"] == "1"
    session = Runtime().open(ModelFile.read(KEPT), 1)
    assert (session.inputs, session.outputs) == (INPUTS, SCORES)


@pytest.mark.parametrize(
    ("runtime", "precision", "line"),
    [
        ("abacus", "float32", "abacus: no such runtime. Give onnxruntime or openvino."),
        ("onnxruntime", "bf16", "computes in float32. Leave it out, or take the runtime openvino."),
        ("openvino", "int4", "precision int4: openvino computes in float32 or bf16. Leave it out."),
        ("openvino", "float32", "pip install 'derain[openvino]'"),
    ],
)
def test_what_no_runtime_has_is_refused_with_what_there_is(
    monkeypatch, runtime, precision, line
) -> None:
    monkeypatch.setitem(sys.modules, "openvino", None)  # importing it is an ImportError
    with pytest.raises(InputError) as refusal:
        Derainer(KEPT, 1, runtime, precision)
    assert str(refusal.value).endswith(line)


def test_a_runtime_of_another_package_is_given_threads_and_precision(rainy) -> None:
    derainer = Derainer(KEPT, 2, "rainy", "int2")
    assert isinstance(derainer.session, rainy)
    assert derainer.session.settings == (2, "int2")
    assert derainer(scene(300)).all()
    loaded = load_method(str(KEPT), {}, 1, Runtime("rainy", "bf16"))
    assert isinstance(loaded, Derainer)
    assert str(loaded.runtime) == "rainy bf16"
    with pytest.raises(InputError, match=r"dror: a filter, .* rainy could run\. Leave it out"):
        load_method("dror", {}, 1, Runtime("rainy"))


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("inputs", {**INPUTS, "more": SCORES[0]}),
        ("inputs", {**INPUTS, "points": TensorType("float64", (None, 4))}),
        ("inputs", {**INPUTS, "points": TensorType("float32", (None, 5))}),
        ("inputs", {**INPUTS, "points": TensorType("float32", (4,))}),
        ("inputs", {"points": INPUTS["points"]}),
        ("outputs", [TensorType("float16", (None, 2))]),
        ("outputs", SCORES * 2),
    ],
)
def test_what_a_network_takes_and_gives_is_checked_whatever_runs_it(
    rainy, monkeypatch, name, value
) -> None:
    monkeypatch.setattr(rainy, name, value)
    with pytest.raises(InputError, match=r"outdet\.onnx: its network takes"):
        Derainer(KEPT, 1, "rainy")


def test_a_runtime_that_drops_inputs_may_show_fewer_of_the_right_types(rainy, monkeypatch) -> None:
    monkeypatch.setattr(rainy, "DROPS_UNUSED_INPUTS", True)
    monkeypatch.setattr(rainy, "inputs", {"points": INPUTS["points"]})
    Derainer(KEPT, 1, "rainy")
    monkeypatch.setattr(rainy, "inputs", {"points": INPUTS["neighbours"]})
    with pytest.raises(InputError, match=r"outdet\.onnx: its network takes"):
        Derainer(KEPT, 1, "rainy")


def test_an_export_for_another_runtime_is_proved_by_that_as_well(
    rainy, monkeypatch, tmp_path
) -> None:
    monkeypatch.setattr(onnx_file, "hard_cases", lambda: [("scene", Scan.of(scene(300)))])
    # The graph need not be traced anew.
    monkeypatch.setattr(onnx_file, "_traced", lambda *_: onnx.load(KEPT))
    model, path = load_model(KEPT.with_suffix(".ckpt")), tmp_path / "made.onnx"
    with pytest.raises(InputError, match="rainy int2: FAILED scene"):
        onnx_file.export(model, path, runtime=Runtime("rainy", "int2"))
    proof = onnx_file.export(model, path, runtime=Runtime("rainy"))
    assert {case.runtime for case in proof.cases} == {"onnxruntime", "rainy"}
    written = Derainer(path, 1).metadata["proof"]["cases"]
    assert {case["runtime"] for case in written} == {"onnxruntime"}


def test_the_versions_name_each_package_that_ran_once(rainy, monkeypatch) -> None:
    for version in (
        f"; derain {derain.__version__}, onnxruntime {onnxruntime.__version__}, ",
        f"NumPy {np.__version__}, Python {platform.python_version()}",
    ):
        assert version in versions()
    assert not versions().startswith(";")
    assert versions(["onnxruntime", "rainy"]) == versions()
    monkeypatch.setattr(rainy, "PACKAGE", "rain-under-another-name")
    assert "rain-under-another-name, NumPy" in versions(["rainy"])


def test_a_network_that_earlier_versions_fuse_wrongly_is_opened_without_that(monkeypatch) -> None:
    usual = onnxruntime.InferenceSession

    def earlier(*arguments: Any, disabled_optimizers: tuple[str, ...] = (), **options: Any) -> Any:
        if WRONG_FUSION not in disabled_optimizers:
            raise NoKernel("Failed to find kernel for com.microsoft.FusedMatMul(1)")
        return usual(*arguments, disabled_optimizers=disabled_optimizers, **options)

    rain = Derainer(threads=1)(scene(300))
    monkeypatch.setattr(onnxruntime, "InferenceSession", earlier)
    np.testing.assert_array_equal(Derainer(threads=1)(scene(300)), rain)
