"""A bag in a folder whose clouds cannot be listed, as a frame that fails as a damaged scan does."""

from dataclasses import dataclass
from typing import Any, NoReturn

from derain.errors import InputError
from derain.sources.file_frame import FileFrame


@dataclass(frozen=True, eq=False, kw_only=True)
class UnreadableBag(FileFrame):
    """Stands for all clouds of a bag. What reads them, or asks for their labels, raises the error.

    Attributes:
        error: Why they cannot be listed.
    """

    error: InputError
    suffix = ""  # there is no file whose format an output could keep

    def _fail(self, *_: Any, **__: Any) -> NoReturn:
        raise self.error

    read = read_label = count_points = fingerprint = require_labels = _fail
