"""Runtimes by name: those of this folder, and those that other packages bring."""

from collections.abc import Iterable
from dataclasses import dataclass

from derain.errors import InputError, did_you_mean
from derain.export.model_file import ModelFile
from derain.export.runtimes.session import FLOAT32_PRECISION, Session
from derain.files.documents import short
from derain.system.registry import Registry

RUNTIMES: Registry[type[Session]] = Registry(
    "derain.export.runtimes", group="derain.runtimes", attribute="NAME"
)

DEFAULT_RUNTIME = "onnxruntime"


@dataclass(frozen=True)
class Runtime:
    """What runs a network, and the precision that it computes in.

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
            remedy = f"{did_you_mean(self.name, RUNTIMES)}Give {_listed(RUNTIMES)}."
            raise InputError(short(self.name), "no such runtime", remedy)
        if self.precision not in RUNTIMES[self.name].PRECISIONS:
            able = [name for name, kind in RUNTIMES.items() if self.precision in kind.PRECISIONS]
            raise InputError(
                f"precision {short(self.precision)}",
                f"{self.name} computes in {_listed(RUNTIMES[self.name].PRECISIONS)}",
                f"Leave it out, or take the runtime {_listed(able)}." if able else "Leave it out.",
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
        """Whether it is what runs models where nobody asks for another."""
        return self == Runtime()

    def __str__(self) -> str:
        """Its name, and its precision where that is not float32."""
        return self.name if self.precision == FLOAT32_PRECISION else f"{self.name} {self.precision}"


def _listed(names: Iterable[str]) -> str:
    return " or ".join(names)
