"""onnxruntime, which comes with derain and runs a model unless another runtime is named."""

from collections.abc import Mapping
from functools import partial
from typing import Any

from derain.export.model_file import ModelFile
from derain.export.runtimes.session import DEFAULT_RUNTIME, RUNTIMES, Session, TensorType
from derain.scan import Array, Float32s
from derain.system.cores import usable_cores

# NumPy's names of what onnxruntime calls the types of a view's inputs and of scores.
NUMPY_NAMES = {"tensor(float)": "float32", "tensor(int64)": "int64", "tensor(bool)": "bool"}

# Before 1.27, onnxruntime makes of a matrix product in float64, as the model that comes with derain
# has one, an operator that it cannot compute.
WRONG_FUSION = "MatmulTransposeFusion"


@RUNTIMES.add(DEFAULT_RUNTIME)
class OnnxRuntimeSession(Session):
    """A network on the CPU by onnxruntime."""

    PACKAGE = "onnxruntime"

    def __init__(self, file: ModelFile, threads: int, precision: str) -> None:
        import onnxruntime
        from onnxruntime.capi.onnxruntime_pybind11_state import NotImplemented as NoKernel

        options = onnxruntime.SessionOptions()
        # Always stated: the default counts the host's cores, not those a container may use.
        # More threads than cores would spin against each other.
        options.intra_op_num_threads = min(threads, usable_cores())
        options.inter_op_num_threads = 1
        options.log_severity_level = 3
        # It would reserve memory for each size of scan anew, beside what other sizes have left.
        options.enable_mem_pattern = False
        # Threads may spin while the network runs; after it, the cores are for the next scan's view.
        options.add_session_config_entry("session.force_spinning_stop", "1")
        opened = partial(
            onnxruntime.InferenceSession, file.content, options, providers=["CPUExecutionProvider"]
        )
        try:
            try:
                self.session = opened()
            except NoKernel:
                self.session = opened(disabled_optimizers=[WRONG_FUSION])
        except Exception as error:  # onnxruntime's exceptions share no base of their own
            raise self.cannot_run(file, error) from error

    @property
    def inputs(self) -> dict[str, TensorType]:
        """Inputs of the network, by name."""
        return {value.name: _type_of(value) for value in self.session.get_inputs()}

    @property
    def outputs(self) -> list[TensorType]:
        """Outputs of the network, in order."""
        return [_type_of(value) for value in self.session.get_outputs()]

    def run(self, inputs: Mapping[str, Array]) -> Float32s:
        """The network's first output."""
        return self.session.run(None, inputs)[0]  # type: ignore[no-any-return]


def _type_of(value: Any) -> TensorType:
    sizes = tuple(size if isinstance(size, int) else None for size in value.shape)
    return TensorType(NUMPY_NAMES.get(value.type, value.type), sizes)
