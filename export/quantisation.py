"""Eight-bit models: smaller, faster on processors with integer dot products, not quite the same."""

import tempfile
from collections.abc import Collection, Iterable, Iterator, Sequence
from pathlib import Path

import numpy as np
import onnx
from numpy.typing import NDArray
from onnxruntime.quantization import (
    CalibrationDataReader,
    CalibrationMethod,
    QuantFormat,
    QuantType,
    quantize_static,
)

from derain.errors import InputError
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.views.view import View, ViewedScan

# Scans that the ranges of activations are taken from; they are held in memory one at a time.
CALIBRATION_SCANS = 16


class CalibrationScans(Collection[Scan]):
    """Scans that are read one at a time, anew whenever they are gone through.

    Args:
        frames: Their frames, whose intensities are in the unit of the model.
    """

    def __init__(self, frames: Sequence[Frame]) -> None:
        self.frames = frames

    def __len__(self) -> int:
        return len(self.frames)

    def __contains__(self, scan: object) -> bool:
        return isinstance(scan, Scan) and scan.name in [frame.name for frame in self.frames]

    def __iter__(self) -> Iterator[Scan]:
        return (frame.read() for frame in self.frames)


class CalibrationReader(CalibrationDataReader):  # type: ignore[misc]
    """Gives onnxruntime the network's inputs, scan by scan.

    Args:
        view: The network's view.
        scans: Scans like those that the model will see.
    """

    def __init__(self, view: View, scans: Iterable[Scan]) -> None:
        # Mapped, for a loop would hold on to one scan while the next is read.
        self._views: Iterator[ViewedScan] = map(view, scans)

    def get_next(self) -> dict[str, NDArray[np.generic]] | None:
        """Inputs of the next scan; None after the last."""
        view = next(self._views, None)
        return None if view is None else view.inputs()


def quantised(
    proto: onnx.ModelProto,
    view: View,
    scans: Iterable[Scan],
    operators: Sequence[str] = ("Conv",),
) -> onnx.ModelProto:
    """The same model with convolutions, and other operators, that compute in eight bits.

    Weights are int8 with a scale per output channel, activations uint8, as the integer dot products
    of AVX-512 VNNI take them. The normalisation of the input, which spans kilometres and
    millimetres, stays in float32.

    Args:
        proto: The model in float32.
        view: The network's view.
        scans: Scans whose activations set the scales.
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
        onnx.save(proto, given)
        quantize_static(
            given,
            path,
            CalibrationReader(view, scans),
            quant_format=QuantFormat.QDQ,
            op_types_to_quantize=list(operators),
            per_channel=True,
            activation_type=QuantType.QUInt8,
            weight_type=QuantType.QInt8,
            calibrate_method=CalibrationMethod.MinMax,
        )
        return onnx.load(path)
