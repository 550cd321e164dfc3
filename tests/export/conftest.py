"""A runtime that a test brings itself."""

from collections.abc import Mapping
from pathlib import Path

import numpy as np
import onnx
import pytest

from derain.export.model_file import ModelFile
from derain.export.runtimes.onnx_runtime import OnnxRuntimeSession
from derain.export.runtimes.session import RUNTIMES, Session, TensorType
from derain.scan import Array, Float32s

# What the runtime "rainy" adds to the score of rain, by its precisions.
RAINY = {"float32": 0.0, "bf16": 0.01, "int2": 1000.0}


class RainySession(Session):
    """onnxruntime, which takes everything for rain the more, the less precise it is."""

    PACKAGE = "onnxruntime"
    PRECISIONS = tuple(RAINY)

    def __init__(self, file: ModelFile, threads: int, precision: str) -> None:
        self.usual = OnnxRuntimeSession(file, threads, "float32")
        self.settings = (threads, precision)

    @property
    def inputs(self) -> dict[str, TensorType]:
        return self.usual.inputs

    @property
    def outputs(self) -> list[TensorType]:
        return self.usual.outputs

    def run(self, inputs: Mapping[str, Array]) -> Float32s:
        return self.usual.run(inputs) + np.float32([0, RAINY[self.settings[1]]])


def shapes_of(model: Path) -> dict[str, list[str | int]]:
    """Shapes of a graph's inputs and outputs, whose sizes are numbers or names."""
    graph = onnx.load(model, load_external_data=False).graph
    return {
        value.name: [size.dim_param or size.dim_value for size in value.type.tensor_type.shape.dim]
        for value in (*graph.input, *graph.output)
    }


@pytest.fixture
def rainy(monkeypatch) -> type[Session]:
    """A runtime of that name for the length of a test."""
    monkeypatch.setattr(RUNTIMES, "_members", dict(RUNTIMES))
    return RUNTIMES.add("rainy")(RainySession)
