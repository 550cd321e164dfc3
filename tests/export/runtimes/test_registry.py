"""A runtime is found by its name, opens what has been looked at, and is refused in one line."""

import os
import platform
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import onnxruntime
import pytest
from onnxruntime.capi.onnxruntime_pybind11_state import NotImplemented as NoKernel

import derain
from derain.errors import InputError
from derain.evaluation.hard_cases import scene
from derain.export.machine import versions
from derain.export.methods import load_method
from derain.export.model_file import ModelFile
from derain.export.runtime import Derainer
from derain.export.runtimes.onnx_runtime import WRONG_FUSION
from derain.export.runtimes.registry import RUNTIMES, Runtime
from derain.export.runtimes.session import Session, TensorType

KEPT = Path(__file__).parent.parent / "kept/outdet.onnx"
SCORES = [TensorType("float32", (None, 2))]


def test_onnxruntime_in_float32_is_what_runs_a_model_unless_another_is_named() -> None:
    assert Derainer(KEPT, 1).runtime == Runtime("onnxruntime", "float32")
    assert Runtime().is_default
    assert {"onnxruntime", "openvino"} <= set(RUNTIMES)
    assert all(name == RUNTIMES[name].NAME for name in RUNTIMES)


def test_a_network_says_what_it_takes_and_gives() -> None:
    session = Runtime().open(ModelFile.read(KEPT), 1)
    assert session.inputs == {
        "points": TensorType("float32", (None, 4)),
        "distances": TensorType("float32", (None, 3)),
        "neighbours": TensorType("int64", (None, 3)),
    }
    assert session.outputs == SCORES


@pytest.mark.parametrize(
    ("runtime", "precision", "line"),
    [
        ("abacus", "float32", "abacus: no such runtime. Give onnxruntime or openvino."),
        ("onnxruntime", "bf16", "computes in float32. Leave it out, or take the runtime openvino."),
        ("openvino", "int4", "precision int4: openvino computes in float32 or bf16. Leave it out."),
    ],
)
def test_what_no_runtime_has_is_refused_with_what_there_is(
    runtime: str, precision: str, line: str
) -> None:
    with pytest.raises(InputError) as refusal:
        Derainer(KEPT, 1, runtime, precision)
    assert str(refusal.value).endswith(line)


def test_openvino_is_asked_for_by_the_extra_that_installs_it(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    monkeypatch.setitem(sys.modules, "openvino", None)  # importing it is an ImportError
    with pytest.raises(InputError) as refusal:
        Derainer(KEPT, 1, "openvino")
    assert str(refusal.value) == (
        "this runtime: needs openvino, which is not installed. pip install 'derain[openvino]'"
    )


def test_a_runtime_of_another_package_is_given_threads_and_precision(rainy: type[Session]) -> None:
    derainer = Derainer(KEPT, 2, "rainy", "int2")
    assert isinstance(derainer.session, rainy)
    assert derainer.session.asked == (2, "int2")
    assert str(derainer.runtime) == "rainy int2"
    assert derainer(scene(300)).all()
    same = Derainer(KEPT, 2, "rainy").probability(scene(300))
    np.testing.assert_array_equal(same, Derainer(KEPT, 2).probability(scene(300)))


@pytest.mark.parametrize(
    "changed",
    [
        lambda session: ("inputs", {**session.inputs, "more": SCORES[0]}),
        lambda session: ("inputs", {**session.inputs, "points": TensorType("float64", (None, 4))}),
        lambda session: ("inputs", {**session.inputs, "points": TensorType("float32", (None, 5))}),
        lambda session: ("inputs", {**session.inputs, "points": TensorType("float32", (4,))}),
        lambda session: ("inputs", {"points": session.inputs["points"]}),
        lambda session: ("inputs", {"image": TensorType("float32", (1, 5, 64, 2048))}),
        lambda session: ("outputs", [TensorType("float16", (None, 2))]),
        lambda session: ("outputs", SCORES * 2),
    ],
)
def test_what_a_network_takes_and_gives_is_checked_whatever_runs_it(
    rainy: type[Session], monkeypatch: pytest.MonkeyPatch, changed: Callable[[Session], object]
) -> None:
    name, value = changed(Runtime().open(ModelFile.read(KEPT), 1))
    monkeypatch.setattr(rainy, name, value)
    with pytest.raises(InputError, match=r"outdet\.onnx: its network takes"):
        Derainer(KEPT, 1, "rainy")


def test_only_a_runtime_that_drops_inputs_may_show_fewer(
    rainy: type[Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    inputs = Runtime().open(ModelFile.read(KEPT), 1).inputs
    monkeypatch.setattr(rainy, "inputs", {"points": inputs["points"]})
    with pytest.raises(InputError, match=r"outdet\.onnx: its network takes"):
        Derainer(KEPT, 1, "rainy")
    monkeypatch.setattr(rainy, "DROPS_UNUSED_INPUTS", True)
    Derainer(KEPT, 1, "rainy")
    monkeypatch.setattr(rainy, "inputs", {"points": inputs["neighbours"]})
    with pytest.raises(InputError, match=r"outdet\.onnx: its network takes"):
        Derainer(KEPT, 1, "rainy")


@pytest.mark.usefixtures("rainy")
def test_a_method_is_run_by_the_runtime_that_is_named_and_a_filter_by_none() -> None:
    assert load_method(str(KEPT), {}, 1, Runtime("rainy", "bf16")).runtime.name == "rainy"
    with pytest.raises(InputError, match=r"dror: a filter, .* rainy could run\. Leave it out"):
        load_method("dror", {}, 1, Runtime("rainy"))


def test_the_versions_name_each_package_that_ran_once(
    rainy: type[Session], monkeypatch: pytest.MonkeyPatch
) -> None:
    for version in (
        f"; derain {derain.__version__}, onnxruntime {onnxruntime.__version__}, ",
        f"NumPy {np.__version__}, Python {platform.python_version()}",
    ):
        assert version in versions()
    assert not versions().startswith(";")
    assert versions(["onnxruntime", "rainy"]) == versions()
    monkeypatch.setattr(rainy, "PACKAGE", "numpy")
    assert versions(["rainy"]).count(np.__version__) == 2
    assert "onnxruntime" not in versions(["rainy"])
    monkeypatch.setattr(rainy, "PACKAGE", "rain-under-another-name")
    assert "rain-under-another-name, NumPy" in versions(["rainy"])


def test_a_network_that_earlier_versions_fuse_wrongly_is_opened_without_that(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    rain = Derainer(threads=1)(scene(300))
    usual = onnxruntime.InferenceSession

    def earlier(*arguments: Any, disabled_optimizers: tuple[str, ...] = (), **options: Any) -> Any:
        if WRONG_FUSION not in disabled_optimizers:
            raise NoKernel("Failed to find kernel for com.microsoft.FusedMatMul(1)")
        return usual(*arguments, disabled_optimizers=disabled_optimizers, **options)

    monkeypatch.setattr(onnxruntime, "InferenceSession", earlier)
    np.testing.assert_array_equal(Derainer(threads=1)(scene(300)), rain)


def test_it_tells_nobody_of_the_models_that_are_opened() -> None:
    assert os.environ["ORT_DISABLE_TELEMETRY"] == "1"
