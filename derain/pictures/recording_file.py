"""A file of Rerun's, written whole or not at all."""

import os
import shutil
from collections.abc import Iterator
from concurrent.futures import Future, ThreadPoolExecutor
from contextlib import contextmanager
from pathlib import Path

import rerun
from rerun.blueprint import Blueprint

from derain.files.atomic import replacing

# Folder of this process's open files by number. Windows has none.
OPEN_FILES = Path("/dev/fd")

# Bytes copied from the pipe to the file at a time.
PIPE_BLOCK = 1 << 20


class RecordingFile:
    """A file that receives Rerun's log.

    Attributes:
        stream: Rerun's stream.
        copying: The copying of what Rerun writes to the file; done early only where it fails.
    """

    def __init__(self, stream: rerun.RecordingStream, copying: Future[None]) -> None:
        self.stream = stream
        self.copying = copying

    def log(self, entity: str, *archetypes: rerun.AsComponents, static: bool = False) -> None:
        """Logs archetypes of an entity.

        Args:
            entity: Path of the entity.
            archetypes: One or more archetypes of Rerun's.
            static: True if they hold at all times.
        """
        self.stream.log(entity, *archetypes, static=static, strict=True)

    def flush(self) -> None:
        """Writes everything logged so far, which bounds the memory in use.

        Raises:
            OSError: The file cannot be written.
        """
        self.stream.flush()
        if self.copying.done():
            self.copying.result()


@contextmanager
def recording_file(path: Path, name: str, blueprint: Blueprint) -> Iterator[RecordingFile]:
    """Opens a file that replaces `path` when the block ends without an error.

    Args:
        path: The file, ``.rrd``.
        name: Name of the recording in the viewer.
        blueprint: Layout of the viewer.

    Raises:
        InputError: The file cannot be written.
    """
    with replacing(path) as temporary, _copied_to(temporary) as (written, copying):
        stream = rerun.RecordingStream("derain")
        stream.set_log_time_enabled(False)  # the time of writing has no meaning here
        stream.set_log_tick_enabled(False)
        stream.save(written, default_blueprint=blueprint)
        try:
            stream.send_recording_name(name)
            file = RecordingFile(stream, copying)
            yield file
            file.flush()
        finally:
            stream.disconnect()  # ends its thread, and writes the index


@contextmanager
def _copied_to(file: Path) -> Iterator[tuple[Path, Future[None]]]:
    """Gives a path for Rerun to write to, and copies what it writes to a file.

    Rerun's library waits for ever once its file cannot grow: on a full disk, or beyond a quota. So
    it writes to a pipe, which a thread empties. On Windows it writes to the file itself.

    Raises:
        OSError: The file cannot be written.
    """
    if not OPEN_FILES.is_dir():
        yield file, Future()
        return
    outlet, inlet = os.pipe()
    with ThreadPoolExecutor(1) as executor:
        copying = executor.submit(_copy, outlet, file)
        try:
            yield OPEN_FILES / str(inlet), copying
        finally:
            os.close(inlet)
        copying.result()


def _copy(outlet: int, file: Path) -> None:
    with open(outlet, "rb") as pipe:
        try:
            with file.open("wb") as opened:
                shutil.copyfileobj(pipe, opened, PIPE_BLOCK)
        except OSError:
            while pipe.read(PIPE_BLOCK):  # keeps the other end from waiting
                pass
            raise
