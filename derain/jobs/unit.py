"""A part of a job that one process does by itself."""

from dataclasses import dataclass


@dataclass(frozen=True, eq=False, kw_only=True)
class Unit:
    """A part of a job: it is done as a whole, in any process, in any order.

    Attributes:
        id: Its relative path, such as ``03/velodyne/000050``, which no other unit of the job has
            and which does not depend on the others.
        size: Bytes of what it reads, or whatever else its time grows with.
        inputs: Fingerprint of what it reads, by sizes and times of change.
    """

    id: str
    size: int
    inputs: str
