"""Eight-bit models: smaller, faster on processors with integer dot products, not quite the same."""

import tempfile
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import onnx
from numpy.typing import NDArray
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quant_pre_process,
    quantize_static,
)

from derain.errors import InputError
from derain.sources.frame import Frame
from derain.views.view import View

# Scans that the ranges of activations are taken from; they are held in memory one at a time.
CALIBRATION_SCANS = 16


class CalibrationReader(CalibrationDataReader):  # type: ignore[misc]
    """Gives onnxruntime the network's inputs, scan by scan.

    Args:
        view: The network's view.
        frames: Scans like those that the model will see; each is read when its turn comes.
    """

    def __init__(self, view: View, frames: Sequence[Frame]) -> None:
        # Not a loop, which would hold on to one scan while the next is read.
        self._inputs = (view(frame.read()).inputs() for frame in frames)

    def get_next(self) -> dict[str, NDArray[np.generic]] | None:
        """Inputs of the next scan; None after the last."""
        return next(self._inputs, None)


def quantised(
    proto: onnx.ModelProto,
    view: View,
    frames: Sequence[Frame],
    operators: Sequence[str],
) -> onnx.ModelProto:
    """The same model with convolutions, and other operators, that compute in eight bits.

    Weights are int8 with a scale per output channel, activations uint8, as the integer dot products
    of AVX-512 VNNI take them. The normalisation of the input, which spans kilometres and
    millimetres, stays in float32.

    Args:
        proto: The model in float32.
        view: The network's view.
        frames: Scans whose activations set the scales, in the unit of the model.
        operators: Names of the operators, in ONNX, that compute in eight bits.

    Raises:
        InputError: A model without convolutions, such as 3D-OutDet: nothing else is
            quantised.
    """
    if not any(node.op_type == "Conv" for node in proto.graph.node):
        raise InputError("--int8", "the network has no convolution to quantise", "Leave it out.")
    with tempfile.TemporaryDirectory() as folder:
        # By way of files: quantize_static moves the tensors out of a model that it is given.
        given, path = Path(folder) / "float32.onnx", Path(folder) / "int8.onnx"
        # onnxruntime warns of a model that this did not prepare. The model is optimised already: it
        # gains only the shapes of its tensors.
        quant_pre_process(proto, given, skip_optimization=True, skip_symbolic_shape=True)
        quantize_static(
            given,
            path,
            CalibrationReader(view, frames),
            quant_format=QuantFormat.QDQ,
            op_types_to_quantize=list(operators),
            per_channel=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            calibrate_method=CalibrationMethod.MinMax,
        )
        return onnx.load(path)
