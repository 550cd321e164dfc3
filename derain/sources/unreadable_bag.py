"""A bag in a folder whose clouds cannot be listed, as a frame that fails as a damaged scan does."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.scan import Scan
from derain.sources.file_frame import FileFrame


@dataclass(frozen=True, eq=False, kw_only=True)
class UnreadableBag(FileFrame):
    """Stands for all clouds of a bag.

    Attributes:
        error: Why they cannot be listed.
    """

    error: InputError

    @property
    def suffix(self) -> str:
        """Empty: there is no file whose format an output could keep."""
        return ""

    def require_labels(self) -> None:
        """Raises the error: whether there are labels is not known."""
        raise self.error

    def read(self) -> Scan:
        """Raises the error."""
        raise self.error

    def read_label(self, points: int) -> NDArray[np.int64]:
        """Raises the error."""
        raise self.error

    def count_points(self) -> int:
        """Raises the error."""
        raise self.error

    def fingerprint(self) -> str:
        """Raises the error."""
        raise self.error

    def checksums(self) -> tuple[str, str | None]:
        """Raises the error."""
        raise self.error
