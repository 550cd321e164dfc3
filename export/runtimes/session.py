"""Runtimes by name, and what each can do: it opens an exported network, and computes its scores."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import ClassVar

from derain.errors import InputError, did_you_mean
from derain.export.model_file import ModelFile
from derain.files.documents import short
from derain.scan import Array, Float32s
from derain.system.registry import Registry

# Those of this folder, and those that other packages bring.
RUNTIMES: Registry[type["Session"]] = Registry(
    "derain.export.runtimes", "derain.runtimes", "Session"
)

DEFAULT_RUNTIME, FLOAT32_PRECISION = "onnxruntime", "float32"


@dataclass(frozen=True)
class TensorType:
    """An input or output of a network: its type and shape.

    Attributes:
        dtype: NumPy's name of the type of its numbers.
        shape: Its sizes; None where one varies from scan to scan.
    """

    dtype: str
    shape: tuple[int | None, ...]


class Session(ABC):
    """An exported network, opened by a runtime.

    A runtime enters derain by its file in ``export/runtimes``, or by an entry point
    ``derain.runtimes`` of another package, and the decorator that gives it its name::

        @RUNTIMES.add("openvino")
        class OpenVinoSession(Session): ...

    Args:
        file: The model, whose bytes have been looked at: they are opened, not the path again.
        threads: Threads that it computes with, 1 or more.
        precision: One of ``PRECISIONS``.

    Attributes:
        NAME: The runtime's name; the decorator sets it.
        PACKAGE: The package that it is installed by, whose version a report of times states.
        PRECISIONS: Supported precisions, on some processors at least.
        DROPS_UNUSED_INPUTS: True if ``inputs`` leaves out what the network has no use for.

    Raises:
        InputError: A runtime that is not installed, a graph that it cannot run, or a precision that
            this processor has not.
    """

    NAME: ClassVar[str]
    PACKAGE: ClassVar[str]
    PRECISIONS: ClassVar[tuple[str, ...]] = (FLOAT32_PRECISION,)
    DROPS_UNUSED_INPUTS: ClassVar[bool] = False

    @abstractmethod
    def __init__(self, file: ModelFile, threads: int, precision: str) -> None: ...

    @property
    @abstractmethod
    def inputs(self) -> dict[str, TensorType]:
        """Inputs of the network, by name."""

    @property
    @abstractmethod
    def outputs(self) -> list[TensorType]:
        """Outputs of the network, in order."""

    @abstractmethod
    def run(self, inputs: Mapping[str, Array]) -> Float32s:
        """The network's first output, an array of its own.

        Args:
            inputs: Arrays by name, of the types of ``inputs``, and any that were dropped.

        Raises:
            Exception: Whatever the runtime raises where the network fails.
        """

    @classmethod
    def cannot_run(cls, file: ModelFile, error: Exception) -> InputError:
        """The error for a graph that the runtime does not accept."""
        lines = [line for line in str(error).splitlines() if line.strip()]
        # OpenVINO begins with lines on the place in its own sources where it stopped.
        reason = next((line for line in lines if not line.startswith("Exception from")), "")
        return InputError(
            file.path,
            f"not an ONNX model that {cls.NAME} can run ({reason or type(error).__name__})",
            "Give a model written by `derain export`.",
        )


@dataclass(frozen=True)
class Runtime:
    """A runtime of networks, and the precision that it computes in.

    Attributes:
        name: One of ``RUNTIMES``.
        precision: One of the runtime's ``PRECISIONS``.

    Raises:
        InputError: No such runtime, or a precision that it has on no processor.
    """

    name: str = DEFAULT_RUNTIME
    precision: str = FLOAT32_PRECISION

    def __post_init__(self) -> None:
        if self.name not in RUNTIMES:
            remedy = f"{did_you_mean(self.name, RUNTIMES)}Give {' or '.join(RUNTIMES)}."
            raise InputError(short(self.name), "no such runtime", remedy)
        if self.precision not in RUNTIMES[self.name].PRECISIONS:
            able = [name for name, kind in RUNTIMES.items() if self.precision in kind.PRECISIONS]
            other = f", or take the runtime {' or '.join(able)}" if able else ""
            raise InputError(
                f"precision {short(self.precision)}",
                f"{self.name} computes in {' or '.join(RUNTIMES[self.name].PRECISIONS)}",
                f"Leave it out{other}.",
            )

    def open(self, file: ModelFile, threads: int) -> Session:
        """Opens a model.

        Args:
            file: The model.
            threads: Threads that its network computes with, 1 or more.

        Raises:
            InputError: A runtime that is not installed, a graph that it cannot run, or a precision
                that this processor has not.
        """
        return RUNTIMES[self.name](file, threads, self.precision)

    @property
    def is_default(self) -> bool:
        """True if it runs models by default."""
        return self == Runtime()

    def __str__(self) -> str:
        """Its name, and its precision where that is not float32."""
        return self.name if self.precision == FLOAT32_PRECISION else f"{self.name} {self.precision}"
