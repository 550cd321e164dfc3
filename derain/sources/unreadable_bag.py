"""A bag in a folder whose clouds cannot be listed, as a frame that fails as a damaged scan does."""

from dataclasses import dataclass

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

    def count_points(self) -> int:
        """Raises the error."""
        raise self.error
