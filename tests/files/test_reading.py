"""What goes wrong while a file is read is told of as the file's fault, unless it is not."""

from pathlib import Path

import pytest

from derain.errors import InputError
from derain.files.reading import reading


def test_a_file_that_cannot_be_read_is_named() -> None:
    with pytest.raises(InputError, match=r"scan\.bin: cannot be read"), reading(Path("scan.bin")):
        raise PermissionError


def test_a_pipe_that_nobody_reads_from_is_no_fault_of_the_file() -> None:
    with pytest.raises(BrokenPipeError), reading(Path("scan.bin")):
        raise BrokenPipeError
