"""A file that a library writes to a path of its own accord, and that a full disk does not halt."""

import os
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from threading import Thread

# Where the system has its open files by number. Windows has no such folder.
OPEN_FILES = Path("/dev/fd")

# Bytes that are taken from the pipe at a time.
PIPE_BLOCK = 1 << 20


class PipedFile:
    """What a library writes, taken from a pipe and written to a file by a thread of ours.

    A library that waits for ever once the disk is full never meets one: the pipe takes all, and
    what cannot be written is let go of. The pipe holds little, so that little is in memory.

    Attributes:
        path: What the library writes to.
        error: What went wrong; None so far.
    """

    def __init__(self, file: Path) -> None:
        self.error: OSError | None = None
        self._outlet, self._inlet = os.pipe()
        self.path = OPEN_FILES / str(self._inlet)
        self._thread = Thread(target=self._write, args=[file], daemon=True)
        self._thread.start()

    def close(self) -> None:
        """Waits until everything is written; the library has closed its path."""
        os.close(self._inlet)
        self._thread.join()
        os.close(self._outlet)

    def _write(self, file: Path) -> None:
        try:
            with file.open("wb", buffering=0) as opened:
                for block in self._blocks():
                    _write_all(opened.fileno(), block)
        except OSError as error:
            self.error = error
            for _ in self._blocks():  # so that nobody waits
                pass

    def _blocks(self) -> Iterator[bytes]:
        while block := os.read(self._outlet, PIPE_BLOCK):
            yield block


class PlainFile:
    """The file itself, where the system has no pipes by name.

    Attributes:
        path: The file.
        error: None: what goes wrong is the library's to tell.
    """

    error = None

    def __init__(self, file: Path) -> None:
        self.path = file

    def close(self) -> None:
        """Does nothing."""


@contextmanager
def piped_file(file: Path) -> Iterator[PipedFile | PlainFile]:
    """Lends a path to write to, of which everything is in a file when the block has ended.

    Args:
        file: The file, which is replaced.
    """
    lent = PipedFile(file) if OPEN_FILES.is_dir() else PlainFile(file)
    try:
        yield lent
    finally:
        lent.close()


def _write_all(descriptor: int, block: bytes) -> None:
    rest = memoryview(block)
    while rest:
        rest = rest[os.write(descriptor, rest) :]
