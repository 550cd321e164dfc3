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
        """Judges the frames of a unit, and reads those around them that the method sees."""
        own, failures = set(unit.frames), list[Judged]()

        @contextmanager
        def catching(frame: Frame) -> Iterator[None]:
            try:
                with reading(Path(frame.name)):  # which names the file where the memory is full
                    yield
            except InputError as error:
                if frame in own:
                    failures.append((frame, error))

        frames = (*unit.before, *unit.frames, *unit.after)
        for answer in judgements(self.method, frames, catching):
            yield from _drained(failures)
            if answer[0] in own:
                yield answer[0], answer
            if unit.after and answer[0] is unit.frames[-1]:
                break  # those after it need no answer
        yield from _drained(failures)

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
            "fingerprint": self.fingerprint,
            "block": block,
            "columns": sorted({",".join(frame.columns) for frame in files}),
            "intensity_scale": sorted({frame.intensity_scale for frame in source}),
        }


def _drained(failures: list[Judged]) -> Iterator[Judged]:
    """Takes failures from the beginning of a list, until it is empty."""
    while failures:
        yield failures.pop(0)
