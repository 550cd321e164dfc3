"""An exported network, opened by a runtime: what every runtime can do."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any, ClassVar

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.export.model_file import ModelFile

FLOAT32_PRECISION = "float32"


@dataclass(frozen=True)
class TensorType:
    """What a network takes or gives under one name.

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
        PACKAGE: What is installed to have it, whose version a report of times says.
        PRECISIONS: What it can compute in, on some processors at least.
        DROPS_UNUSED_INPUTS: Whether ``inputs`` leaves out what the network has no use for.

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
        """What the network takes, by name."""

    @property
    @abstractmethod
    def outputs(self) -> list[TensorType]:
        """What the network gives, in order."""

    @abstractmethod
    def run(self, inputs: Mapping[str, NDArray[Any]]) -> NDArray[np.float32]:
        """The network's first output, an array of its own.

        Args:
            inputs: Arrays by name, of the types that ``inputs`` says, and any that were dropped.

        Raises:
            Exception: Whatever the runtime raises where the network fails.
        """

    @classmethod
    def cannot_run(cls, file: ModelFile, error: Exception) -> InputError:
        """What to raise of a graph that the runtime does not take."""
        lines = [line for line in str(error).splitlines() if line.strip()]
        # OpenVINO begins with lines that say where in its own sources it stopped.
        reason = next((line for line in lines if not line.startswith("Exception from")), "")
        return InputError(
            file.path,
            f"not an ONNX model that {cls.NAME} can run ({reason or type(error).__name__})",
            "Give a model written by `derain export`.",
        )
