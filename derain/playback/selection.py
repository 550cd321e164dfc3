"""Which scans of a recording are shown, and when and where each was taken."""

from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray

from derain.errors import InputError
from derain.sources.frame import Frame
from derain.sources.method import Method
from derain.sources.source import Source
from derain.system.notices import warn


@dataclass(frozen=True, eq=False)
class Selection:
    """Some scans of a source, in time order.

    Attributes:
        source: All of them.
        numbers: The places of those that are shown, ascending.
        held_out: Keys of scans from which nothing was learnt, where something was.

    Raises:
        InputError: None is shown.
    """

    source: Source
    numbers: Sequence[int]
    held_out: frozenset[str] = frozenset()

    def __post_init__(self) -> None:
        if not self.numbers:
            raise InputError(
                "--frames",
                f"none of them is among the {len(self.source):,} scans",
                "They count from 0; leave it out to show all.",
            )

    @cached_property
    def frames(self) -> list[Frame]:
        """Those that are shown."""
        return [self.source[number] for number in self.numbers]

    @cached_property
    def number_of(self) -> dict[str, int]:
        """The place of each that is shown among all, by its key."""
        return {frame.key: n for n, frame in zip(self.numbers, self.frames, strict=True)}

    def for_method(self, method: Method) -> Sequence[Frame]:
        """What a method is given: one that sees several scans also gets those that are not shown.

        Args:
            method: The method.
        """
        window = method.window
        if window.is_one_scan:
            return self.frames
        first, last = self.numbers[0], self.numbers[-1]
        return self.source[max(first - window.before, 0) : last + 1 + window.after]

    @cached_property
    def seconds(self) -> dict[str, float]:
        """When each was taken, by its key, seconds after the first one.

        Empty where it is not known of all of them, or they do not follow one another in time, as
        where several recordings are shown.
        """
        try:
            times = [frame.time for frame in self.frames]
        except InputError as error:
            warn(f"when the scans were taken is not shown: {error}")
            return {}
        known = [time for time in times if time is not None]
        if len(known) < len(times) or any(before >= after for before, after in pairwise(known)):
            return {}
        return {f.key: time - known[0] for f, time in zip(self.frames, known, strict=True)}

    @cached_property
    def poses(self) -> dict[str, NDArray[np.float64]]:
        """Where each was taken, by its key, float64 (4, 4), metres.

        They take the sensor's frame to that of the first scan of its sequence that is shown: far
        from the origin the viewer, which computes in float32, would let the points tremble. Empty
        where a scan has none.
        """
        try:
            poses = [frame.pose for frame in self.frames]
        except InputError as error:
            warn(f"where the scans were taken is not shown: {error}")
            return {}
        to_first: dict[str, NDArray[np.float64]] = {}
        placed = {}
        for frame, pose in zip(self.frames, poses, strict=True):
            if pose is None:
                return {}
            back = to_first.setdefault(frame.sequence, np.linalg.inv(pose).astype(np.float64))
            placed[frame.key] = back @ pose
        return placed

    @cached_property
    def ways(self) -> list[NDArray[np.float32]]:
        """Where the sensor went in each sequence, float32 (scans, 3), metres."""
        ways: dict[str, list[NDArray[np.float64]]] = {}
        for frame in self.frames:
            if frame.key in self.poses:
                ways.setdefault(frame.sequence, []).append(self.poses[frame.key][:3, 3])
        return [np.array(way, np.float32) for way in ways.values()]
