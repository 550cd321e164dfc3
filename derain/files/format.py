"""The base class of formats of scan files, and their registry."""

from abc import ABC, abstractmethod
from collections.abc import Sequence
from pathlib import Path
from typing import ClassVar

from derain.errors import InputError
from derain.files.content import Content
from derain.files.names import scan_suffix
from derain.scan import Scan
from derain.system.extras import Extra
from derain.system.registry import Registry


class Format(ABC):
    """A format of scan files: one file, found by being in `derain.files.formats`.

    A decorator lists the suffixes of its files, in lower case::

        @FORMATS.add(".pcd")
        class Pcd(Format): ...

    A package outside derain brings one by naming the module that holds it::

        [project.entry-points."derain.formats"]
        mine = "my_package.my_format"

    Attributes:
        HELP: Description, for ``derain info --formats``.
        DAMAGE: Exceptions of :meth:`decode`, besides InputError, on content that it cannot read.
        EXTRA: Extra that must be installed for it, if any.
        NAMES_COLUMNS: True if its files name their columns, so that a further one is understood.
    """

    HELP: ClassVar[str] = ""
    DAMAGE: ClassVar[tuple[type[Exception], ...]] = (ValueError,)
    EXTRA: ClassVar[Extra | None] = None
    NAMES_COLUMNS: ClassVar[bool] = True

    @abstractmethod
    def decode(self, content: Content, columns: Sequence[str]) -> Scan:
        """Makes a scan of a file's content, one point per row of the file, in its order.

        Args:
            content: The file. What it expands to is reserved in its ``budget`` first.
            columns: Names of its columns, which count where the file does not name them itself.

        Raises:
            InputError: Content without what a scan needs, such as coordinates.
            Exception: One of DAMAGE, on content that it cannot read.
        """

    @abstractmethod
    def encode(self, path: Path, scan: Scan) -> bytes:
        """Makes the content of a file of a scan: every column of ``scan.fields``, if it has any.

        Args:
            path: The file to be written, for messages; its suffix is one of the format's.
            scan: The scan, read from a file of any format or made in memory.

        Raises:
            InputError: A scan that the format cannot hold.
        """

    def count(self, path: Path, columns: Sequence[str]) -> int | None:
        """Number of points of an uncompressed file, if its size determines it, else None.

        Args:
            path: The file.
            columns: As for `decode`.

        Raises:
            InputError: A file that cannot be read.
        """
        return None


FORMATS: Registry[type[Format]] = Registry("derain.files.formats", "derain.formats", "Format")


def format_of(path: Path) -> Format:
    """The format of a file, by its suffix.

    Raises:
        InputError: No format has this suffix.
    """
    suffix = scan_suffix(path)
    if suffix not in FORMATS:
        available = f"Available: {', '.join(FORMATS)}, and each of them with .gz."
        remedy = f"{available} Convert others to one of these, in the frame of the sensor."
        raise InputError(path, f"'{suffix}' is not the suffix of a scan", remedy)
    return FORMATS[suffix]()
