"""Judges the scans of one unit, and lists the options that its results depend on."""

from abc import abstractmethod
from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any, TypeVar

from derain.errors import InputError
from derain.files.reading import reading
from derain.jobs.running import Result, Work
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import answers
from derain.sources.method import Method
from derain.sources.units import FrameUnit, shared_options
from derain.system.stopwatch import Stopwatch

ResultT = TypeVar("ResultT", bound=Result)


@dataclass(frozen=True)
class UnitJudging(Work[FrameUnit, ResultT]):
    """Work that judges the scans of a unit one after the other.

    Attributes:
        method: Method that judges them.
        fingerprint: That of the method where the job began.
    """

    method: Method
    fingerprint: str

    def check(self) -> None:
        """Refuses a method that is another one here, such as a model's file that has changed."""
        if self.method.fingerprint() != self.fingerprint:
            raise InputError(
                str(self.method.as_dict()["method"]),
                "differs from the file that the run started with",
                "Copy the file to every machine.",
            )

    @abstractmethod
    def failure(self, frame: Frame, error: InputError) -> ResultT:
        """The result of a scan that failed."""

    def failed(self, unit: FrameUnit, error: InputError) -> ResultT:
        """The result of a unit that failed as a whole: the failure of its first scan."""
        return self.failure(unit.frames[0], error)

    def results(
        self, unit: FrameUnit, result: Callable[[Frame, Judgement, Stopwatch], ResultT]
    ) -> Iterator[ResultT]:
        """Judges the scans of a unit, and makes a result of each.

        Args:
            unit: The unit.
            result: Makes it of a frame, its judgement, and the times of the stages.

        Yields:
            The result of each frame of the unit, once.
        """
        frames = (*unit.before, *unit.frames, *unit.after)
        waiting = dict.fromkeys(unit.frames)  # those without answer, in order
        for frame, answer, stopwatch in answers(self.method, frames):
            if frame in waiting:
                del waiting[frame]
                try:
                    if isinstance(answer, InputError):
                        raise answer
                    with reading(Path(frame.name)):  # which names the file where memory is full
                        made = result(frame, answer, stopwatch)
                except InputError as error:
                    made = self.failure(frame, error)
                yield made
            if unit.after and not waiting:
                break  # those after the unit need no answer
        for frame in waiting:  # of a method whose errors do not name the scan
            none = InputError(frame.name, "has no answer", "See the errors of the scans around it.")
            yield self.failure(frame, none)

    def options(self, command: str, source: Sequence[Frame], block: int) -> dict[str, Any]:
        """The options that the answers depend on besides the scans, for the job of a command.

        Args:
            command: Name of the command.
            source: The scans.
            block: Scans of a block.
        """
        parameters = self.method.as_dict()
        return {
            **shared_options(command, source, block),
            **parameters,
            "method": Path(parameters["method"]).name,
            "content of the method": self.fingerprint,
        }
