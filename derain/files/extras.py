"""Libraries that only some formats need, and that are therefore installed on demand."""

from dataclasses import dataclass
from importlib import import_module
from importlib.util import find_spec
from pathlib import Path
from types import ModuleType

from derain.errors import InputError
from derain.files.names import scan_suffix


@dataclass(frozen=True)
class Extra:
    """One of derain's extras, as in ``pip install 'derain[las]'``.

    Attributes:
        name: Its name.
        library: Name of the module that it installs.
    """

    name: str
    library: str

    @property
    def installed(self) -> bool:
        """Whether the library is there; it is not imported."""
        return find_spec(self.library) is not None

    def load(self, path: Path, submodule: str = "") -> ModuleType:
        """Imports the library.

        Args:
            path: The file that needs it, for the message.
            submodule: Name of a module within it, where that is wanted.

        Raises:
            InputError: It is not installed.
        """
        name = f"{self.library}.{submodule}" if submodule else self.library
        try:
            return import_module(name)
        except ImportError as error:
            raise InputError(
                path,
                f"{scan_suffix(path)} needs {name}, which is not installed ({error})",
                f"pip install 'derain[{self.name}]'.",
            ) from error
