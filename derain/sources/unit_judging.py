"""Judges the scans of one unit, and what a job has to know of it."""

from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

import derain
from derain.errors import InputError
from derain.files.reading import reading
from derain.jobs.running import Work
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.judging import Answer, judgements
from derain.sources.method import Method
from derain.sources.units import FrameUnit

ResultT = TypeVar("ResultT")

# A frame of a unit, and its answer, or why it has none.
Judged = tuple[Frame, Answer | InputError]


@dataclass(frozen=True)
class UnitJudging(Work[FrameUnit, ResultT]):
    """Work that judges the scans of a unit one after the other.

    Attributes:
        method: What judges them.
        fingerprint: That of the method where the job began.
    """

    method: Method
    fingerprint: str

    def check(self) -> None:
        """Refuses a method that is another one here, such as a model's file that has changed."""
        if self.method.fingerprint() != self.fingerprint:
            raise InputError(
                str(self.method.as_dict()["method"]),
                "is not the same here as where the run began",
                "Copy the file to every machine.",
            )

    def judged(self, unit: FrameUnit) -> Iterator[Judged]:
        """Judges the frames of a unit, and reads those around them that the method sees.

        Yields:
            Each frame of the unit once, with its answer or the reason why it has none.
        """
        frames = (*unit.before, *unit.frames, *unit.after)
        waiting = dict.fromkeys(unit.frames)  # those without answer, in order
        caught: list[Judged] = []

        @contextmanager
        def catching(frame: Frame) -> Iterator[None]:
            try:
                with reading(Path(frame.name)):  # which names the file where the memory is full
                    yield
            except InputError as error:
                caught.append((frame, error))

        of_nobody: list[InputError] = []
        for answer in judgements(self.method, frames, catching):
            for frame, judged in (*self._failed(caught, frames, of_nobody), (answer[0], answer)):
                if frame in waiting:
                    del waiting[frame]
                    yield frame, judged
            if unit.after and not waiting:
                break  # those after the unit need no answer
        for frame, error in self._failed(caught, frames, of_nobody):
            if frame in waiting:
                del waiting[frame]
                yield frame, error
        for frame in waiting:
            none = InputError(frame.name, "has no answer", "See the errors of the scans around it.")
            yield frame, of_nobody.pop(0) if of_nobody else none

    def _failed(
        self, caught: list[Judged], frames: Sequence[Frame], of_nobody: list[InputError]
    ) -> Iterator[Judged]:
        """The frames that caught errors are about.

        A method of several scans may fail at a scan that was pushed before; where an error does not
        name one, such as that of a network, it is of one that gets no answer.

        Args:
            caught: Each error, with the frame that was pushed; emptied.
            frames: All frames that were pushed.
            of_nobody: Takes the errors that name no frame.
        """
        while caught:
            pushed, error = caught.pop(0)
            assert isinstance(error, InputError)
            if not self.method.window.is_one_scan:
                named = [frame for frame in frames if frame.name == str(error.subject)]
                if not named:
                    of_nobody.append(error)
                    continue
                pushed = named[0]
            yield pushed, error

    def options(self, command: str, source: Sequence[Frame], block: int) -> dict[str, Any]:
        """What the answers depend on but the scans, for the job of a command.

        Args:
            command: Name of the command.
            source: The scans.
            block: Scans of a block.
        """
        parameters = self.method.as_dict()
        files = [frame for frame in source if isinstance(frame, FileFrame)]
        return {
            "command": command,
            "derain": derain.__version__,
            **parameters,
            "method": Path(parameters["method"]).name,
            "content of the method": self.fingerprint,
            "block": block,
            "columns": sorted({",".join(frame.columns) for frame in files}),
            "intensity_scale": sorted({frame.intensity_scale for frame in source}),
        }
