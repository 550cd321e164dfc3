"""Of onnxruntime, what differs between its versions."""

import os
from typing import Any

import numpy as np
import pytest

from derain.evaluation.hard_cases import scene
from derain.export.runtime import Derainer
from derain.export.runtimes.onnx_runtime import WRONG_FUSION


def test_a_network_that_earlier_versions_fuse_wrongly_is_opened_without_that(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    import onnxruntime
    from onnxruntime.capi.onnxruntime_pybind11_state import NotImplemented as NoKernel

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
