"""A file of Rerun's, written whole or not at all."""

import warnings
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import rerun
from rerun.blueprint import Blueprint
from rerun.chunk import RrdReader

from derain.errors import InputError, reason_of
from derain.files.atomic import replacing
from derain.playback.entities import FRAME, TIME
from derain.playback.piped_file import PipedFile, PlainFile, piped_file


class RecordingFile:
    """What is logged, on its way to a file.

    Args:
        path: The file that the user named, for messages.
        stream: What Rerun logs to.
        written: What Rerun's library writes to.
    """

    def __init__(
        self, path: Path, stream: rerun.RecordingStream, written: PipedFile | PlainFile
    ) -> None:
        self.path = path
        self.stream = stream
        self.written = written

    def at(self, number: int, seconds: float | None) -> None:
        """Says of which scan all that is logged from here on is.

        Args:
            number: Its place in the recording.
            seconds: When it was taken, after the first one that is shown; None if not known.
        """
        self.stream.reset_time()
        self.stream.set_time(FRAME, sequence=number)
        if seconds is not None:
            self.stream.set_time(TIME, duration=seconds)

    def log(self, path: str, *what: rerun.AsComponents, static: bool = False) -> None:
        """Logs something.

        Args:
            path: Where it stands.
            what: Archetypes of Rerun's.
            static: Whether it is so at all times.
        """
        first, *others = what
        self.stream.log(path, first, *others, static=static, strict=True)

    def flush(self) -> None:
        """Has everything written, so that little waits in memory.

        Raises:
            InputError: It cannot be written.
        """
        try:
            self.stream.flush()
        except RuntimeError as error:
            raise _not_written(self.path, error) from error
        self.refuse_not_written()

    def refuse_not_written(self) -> None:
        """Says so where something could not be written.

        Raises:
            InputError: Something could not.
        """
        if self.written.error is not None:
            raise _not_written(self.path, self.written.error)


@contextmanager
def recording_file(path: Path, name: str, blueprint: Blueprint) -> Iterator[RecordingFile]:
    """Lends a file that takes the place of `path` when the block ends well.

    Args:
        path: The file, ``.rrd``.
        name: What the viewer calls the recording.
        blueprint: What the viewer opens with.

    Raises:
        InputError: It cannot be written.
    """
    with replacing(path) as temporary:
        with piped_file(temporary) as written:
            stream = rerun.RecordingStream("derain")
            stream.set_log_time_enabled(False)  # when it was written tells nothing of the scans
            stream.set_log_tick_enabled(False)
            stream.save(written.path, default_blueprint=blueprint)
            file = RecordingFile(path, stream, written)
            try:
                stream.send_recording_name(name)
                yield file
                file.flush()
            finally:
                stream.disconnect()  # ends its thread, and writes the index
        file.refuse_not_written()
        _refuse_incomplete(path, temporary)


def _refuse_incomplete(path: Path, temporary: Path) -> None:
    """Refuses a file without the index that is written last."""
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")
            RrdReader(temporary).store()
    except (RuntimeError, ValueError, Warning) as error:
        raise _not_written(path, error) from error


def _not_written(path: Path, error: Exception) -> InputError:
    reason = getattr(error, "strerror", None) or reason_of(error)
    return InputError(
        path,
        f"cannot be written whole ({reason})",
        "Choose a folder that has room, or show fewer scans: --every 10.",
    )
