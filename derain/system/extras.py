"""Optional libraries, and the extras of derain that install them.

Plain ``pip install derain`` installs what a robot needs. Everything else is in an extra, such as
``pip install 'derain[train]'``, and is imported where it is used.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from derain.errors import InputError, reason_of


class MissingExtraError(InputError, ModuleNotFoundError):
    """A library of one of derain's extras is not installed.

    The command line reports it as a user's error; Python code can catch it as the error of a failed
    ``import``.
    """


@dataclass(frozen=True)
class Extra:
    """A library of one of derain's extras, as in ``pip install 'derain[ros]'``.

    Attributes:
        name: Name of the smallest extra that installs the library.
        library: Name of the module that it installs.
    """

    name: str
    library: str

    @property
    def installed(self) -> bool:
        """True if the library is installed; it is not imported."""
        return find_spec(self.library) is not None

    def load(self, subject: str | Path, submodule: str = "") -> ModuleType:
        """Imports the library.

        Args:
            subject: The user of it, for the message: a file, a command.
            submodule: Name of a module within it to import instead.

        Raises:
            MissingExtraError: It is not installed.
            InputError: It is installed, and cannot be imported.
        """
        name = f"{self.library}.{submodule}" if submodule else self.library
        try:
            return import_module(name)
        except (ImportError, OSError) as error:
            if isinstance(error.__cause__, KeyboardInterrupt):  # turned into one by C++
                raise error.__cause__ from None
            if isinstance(error, ModuleNotFoundError) and error.name in (self.library, name):
                raise _missing(subject, [self]) from error
            raise InputError(
                subject,
                f"needs {name}, which cannot be imported ({reason_of(error)})",
                "Install the package that it names, or reinstall the library.",
            ) from error


TORCH = Extra("train", "torch")
LIGHTNING = Extra("train", "lightning")
TORCHMETRICS = Extra("train", "torchmetrics")
JSONARGPARSE = Extra("train", "jsonargparse")
TENSORBOARD = Extra("train", "tensorboard")
MATPLOTLIB = Extra("view", "matplotlib")
ONNX = Extra("train", "onnx")
ONNXSCRIPT = Extra("train", "onnxscript")
OPTUNA = Extra("train", "optuna")
OPEN3D = Extra("scene", "open3d")
PYARROW = Extra("feather", "pyarrow")
FLATBUFFERS = Extra("feather", "flatbuffers")
OPENVINO = Extra("openvino", "openvino")
ROSBAGS = Extra("ros", "rosbags")
MCAP = Extra("ros", "mcap")
APSW = Extra("ros", "apsw")
LZ4 = Extra("ros", "lz4")
ZSTANDARD = Extra("ros", "zstandard")
RERUN = Extra("view", "rerun")
DISTRIBUTED = Extra("cluster", "distributed")
FSSPEC = Extra("remote", "fsspec")

EXTRAS = (
    *(TORCH, LIGHTNING, TORCHMETRICS, JSONARGPARSE, TENSORBOARD, MATPLOTLIB),
    *(ONNX, ONNXSCRIPT, OPTUNA, OPEN3D, PYARROW, FLATBUFFERS),
    *(OPENVINO, ROSBAGS, MCAP, RERUN, DISTRIBUTED, FSSPEC),
)

# What is needed to read a checkpoint, to make an ONNX file of it, and to train it. Their extra also
# installs matplotlib.
CHECKPOINT_LIBRARIES = (TORCH, LIGHTNING, TORCHMETRICS)
EXPORT_LIBRARIES = (*CHECKPOINT_LIBRARIES, ONNX, ONNXSCRIPT)
TRAINING_LIBRARIES = (*CHECKPOINT_LIBRARIES, JSONARGPARSE, TENSORBOARD)


def require(subject: str | Path, *extras: Extra) -> None:
    """Refuses work, before it begins, where libraries that it needs are not installed.

    Args:
        subject: The user of them, for the message: a command, an option, a file.
        extras: The libraries; none is imported.

    Raises:
        MissingExtraError: One or more of them are not installed.
    """
    missing = [extra for extra in dict.fromkeys(extras) if not extra.installed]
    if missing:
        raise _missing(subject, missing)


def missing_extra(subject: str | Path, error: ModuleNotFoundError) -> MissingExtraError | None:
    """The error for a failed import; None where no extra of derain installs the library."""
    library = (error.name or "").partition(".")[0]
    found = [extra for extra in EXTRAS if extra.library == library and not extra.installed]
    return _missing(subject, found) if found else None


def _missing(subject: str | Path, extras: Sequence[Extra]) -> MissingExtraError:
    *others, last = [extra.library for extra in extras]
    libraries = f"{', '.join(others)} and {last}" if others else last
    names = dict.fromkeys(extra.name for extra in extras)
    error = MissingExtraError(
        subject,
        f"needs {libraries}, which {'are' if others else 'is'} not installed",
        f"pip install 'derain[{','.join(names)}]'",
    )
    error.name = extras[0].library
    return error
