"""A part of a job that one process does by itself, and the record of its result."""

from dataclasses import dataclass
from typing import Any

from derain.errors import InputError


@dataclass(frozen=True, eq=False, kw_only=True)
class Unit:
    """A part of a job: it is done as a whole, in any process, in any order.

    Attributes:
        id: Its relative path, such as ``03/velodyne/000050``, which no other unit of the job has
            and which does not depend on the others.
        size: Bytes of its inputs, or another measure that its time grows with.
        inputs: Fingerprint of its inputs, by sizes and times of change.
    """

    id: str
    size: int
    inputs: str


@dataclass(frozen=True)
class Record:
    """The record of a unit's work.

    Attributes:
        unit: Id of the unit.
        inputs: Fingerprint of its inputs.
        options: Fingerprint of the options of its job.
        worker: Host and number of the process.
        seconds: Duration, seconds.
        errors: Errors, with subject, reason and remedy each; empty without errors.
        results: Results, in the form of the job.
    """

    unit: str
    inputs: str
    options: str
    worker: str
    seconds: float
    errors: list[list[str]]
    results: list[Any]

    @property
    def failures(self) -> list[InputError]:
        """The failures of the unit."""
        return [InputError(*error) for error in self.errors]
