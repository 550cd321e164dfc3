"""OpenVINO, which computes in bfloat16 too where the processor does."""

import sys
from collections.abc import Mapping
from threading import Lock
from typing import Any

import numpy as np

from derain.errors import InputError
from derain.export.model_file import ModelFile
from derain.export.runtimes.session import FLOAT32_PRECISION, RUNTIMES, Session, TensorType
from derain.scan import Array, Float32s
from derain.system.extras import OPENVINO

DEVICE = "CPU"

# The package by which OpenVINO reports that it was imported.
TELEMETRY = "openvino_telemetry"

# OpenVINO's name of a precision, and the capability of a processor that it needs. For bfloat16 on a
# processor without it, OpenVINO imitates it with AVX-512, which takes twice as long as float32, and
# with AVX2 computes in float32 without notice.
PRECISIONS = {FLOAT32_PRECISION: ("f32", "FP32"), "bf16": ("bf16", "BF16")}

# Kernels that OpenVINO keeps for sizes of inputs it has seen. In bfloat16 it makes some for every
# number of points, and keeps up to 5,000: over a recording, a gigabyte in a thousand scans.
MOST_KERNELS = 64


@RUNTIMES.add("openvino")
class OpenVinoSession(Session):
    """A network on the CPU by OpenVINO."""

    PACKAGE = "openvino"
    PRECISIONS = tuple(PRECISIONS)
    DROPS_UNUSED_INPUTS = True

    def __init__(self, file: ModelFile, threads: int, precision: str) -> None:
        openvino = import_openvino()
        core = openvino.Core()
        hint, capability = PRECISIONS[precision]
        if capability not in core.get_property(DEVICE, "OPTIMIZATION_CAPABILITIES"):
            raise InputError(
                f"precision {precision}",
                "this processor has none, and emulating it is slower than float32",
                "Leave it out, or take a processor with AVX-512 BF16 or AMX.",
            )
        options = {
            # Always stated: the default is bfloat16 wherever the processor has it, and as many
            # threads as the host has cores.
            "INFERENCE_PRECISION_HINT": hint,
            "INFERENCE_NUM_THREADS": threads,
            "ENABLE_HYPER_THREADING": True,  # or it counts physical cores, and takes no more
            # One scan at a time, as soon as it can be.
            "PERFORMANCE_HINT": "LATENCY",
            "NUM_STREAMS": 1,
            # The view's threads have the same cores, and two processes would be pinned to the same.
            "ENABLE_CPU_PINNING": False,
            "CPU_RUNTIME_CACHE_CAPACITY": MOST_KERNELS,
        }
        try:
            self.model = core.compile_model(core.read_model(file.content), DEVICE, options)
        except Exception as error:  # OpenVINO raises RuntimeError, its bindings more
            raise self.cannot_run(file, error) from error
        self._request = self.model.create_infer_request()
        self._taken = tuple(self.inputs)
        self._one_at_a_time = Lock()

    @property
    def inputs(self) -> dict[str, TensorType]:
        """Inputs of the network, by name."""
        return {port.get_any_name(): _type_of(port) for port in self.model.inputs}

    @property
    def outputs(self) -> list[TensorType]:
        """Outputs of the network, in order."""
        return [_type_of(port) for port in self.model.outputs]

    def run(self, inputs: Mapping[str, Array]) -> Float32s:
        """The network's first output."""
        with self._one_at_a_time:  # a second call would be refused while the request is busy
            self._request.infer({name: inputs[name] for name in self._taken}, share_inputs=True)
            # Copied: the memory is the request's, which writes the next scan's scores to it.
            return np.array(self._request.get_output_tensor(0).data)


def _type_of(port: Any) -> TensorType:
    sizes = tuple(size.get_length() if size.is_static else None for size in port.partial_shape)
    return TensorType(port.element_type.to_dtype().name, sizes)


def import_openvino() -> Any:
    """Imports OpenVINO where it is needed; nothing else in derain imports it.

    The package openvino-telemetry is kept from being imported meanwhile. OpenVINO depends on it
    and, with it in place, reports every import of itself over the network unless the user has opted
    out; without it OpenVINO is content with a stub. Whoever has imported it before has it back
    afterwards.

    Returns:
        The module openvino.

    Raises:
        MissingExtraError: OpenVINO is not installed.
        InputError: A library that it links against is missing.

    Source: openvino/tools/ovc/__init__.py of OpenVINO 2026.4.1, which sends "general_import".
    """
    former = {name: module for name, module in sys.modules.items() if _is_telemetry(name)}
    for name in former:
        del sys.modules[name]
    sys.modules[TELEMETRY] = None  # type: ignore[assignment]  # importing it is an ImportError
    try:
        return OPENVINO.load("this runtime")
    finally:
        del sys.modules[TELEMETRY]
        sys.modules.update(former)


def _is_telemetry(name: str) -> bool:
    return name == TELEMETRY or name.startswith(f"{TELEMETRY}.")
