"""Rain by free space: what rays of the scans before and after went through was not there."""

from collections.abc import Iterator
from dataclasses import asdict, dataclass
from typing import Any, Self
from weakref import WeakKeyDictionary

import numpy as np

from derain.files.documents import Entry
from derain.recordings.evidence import (
    ScanPoints,
    combined_log_odds,
    surroundings_log_odds,
    vote,
)
from derain.recordings.placing import UNLIKE, PlacedFrames, PlacedMethod, is_alike
from derain.recordings.rays import RayEvidence, mean_evidence
from derain.scan import Bools, Floats, Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.window import Window, WindowOfScans
from derain.system.cores import threads_of
from derain.system.stopwatch import Stopwatch
from derain.views.one_viewpoint import viewpoint_issues
from derain.views.scan_issues import ScanIssue, intensity_in_places


@dataclass(frozen=True)
class Persistence:
    """Parameters of persistence: its window, and the odds at which it is sure.

    Example:
        >>> PersistenceDerainer(Persistence(before=2, after=0)).window
        Window(before=2, after=0)

    Attributes:
        before: Scans before the one that is judged.
        after: Scans after it.
        sure: Odds, to one, from which on it is sure of an answer on which a point and its
            neighbours agree.

    Raises:
        InputError: Other numbers of scans than 0 to 50, or odds below one.
    """

    before: int = 1
    after: int = 1
    sure: float = 3.0

    def __post_init__(self) -> None:
        Window(self.before, self.after)  # which refuses other numbers
        sure = Entry("persistence", "sure", self.sure)
        if sure.number() < 1:
            raise sure.fault(f"{self.sure:g} is not 1 or more", "Give the odds of a sure answer.")


class PersistenceDerainer(PlacedMethod):
    """Calls rain what is not where it was, by rays of other scans and its surroundings.

    Solid things are where they were a tenth of a second ago; a drop is not, and the rays that pass
    its place in the scans before and after go through it. What moves, as cars do, hangs together
    in its own scan, and a drop does not. So neither intensity nor anything that is learnt from
    labels is needed; see :mod:`derain.recordings`.

    Poses are those of the frames. Where a frame has none, or the record of it is damaged, they are
    found as it goes, and where that fails, no evidence is taken across the gap. A scan without any
    other, or that no other matches at its pose, is judged by itself: nothing of it is known for
    sure, and nothing of it is called rain. Its stages are read, odometry where no pose is given,
    view, network (the evidence) and back.

    Example:
        >>> scans = [derain.read_scan("scan.bin")] * 3  # one scan again, which gives no evidence
        >>> method = PersistenceDerainer()
        >>> answers = [method.push(scan) for scan in scans] + list(method.flush())
        >>> [answer is None for answer in answers]  # each but the last waits for the scan after it
        [True, False, False, False]

    Args:
        persistence: Its window, and the odds at which it is sure.
        threads: Threads to use; 0 takes every core this process may use.

    Source: free and occupied space as evidence follows occupancy grids (A. Elfes, "Using Occupancy
        Grids for Mobile Robot Perception and Navigation", 1989), with rays instead of cells.
    """

    # The method's definition of rain, in one line for the help of commands.
    HELP = "rain does not stay in its place: rays of other scans pass through it"

    def __init__(self, persistence: Persistence = Persistence(), threads: int = 0) -> None:
        self.persistence = persistence
        self.threads = threads_of(threads)
        self._end_recording()

    @property
    def window(self) -> Window:
        """The scans before and after the one that it judges."""
        return Window(self.persistence.before, self.persistence.after)

    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        """Warnings about a scan: its places, nothing known of it, or no pose to be trusted."""
        yield from viewpoint_issues(judgement.scan)
        yield from intensity_in_places(judgement.scan, judgement.judged)
        yield from self._recent.doubts.get(judgement.scan, ())
        if judgement.known is not None and not judgement.known.any() and judgement.judged.any():
            yield ScanIssue(
                "nothing is known for sure",
                "no scan before or after it gives evidence: none of its points is called rain",
            )

    def as_dict(self) -> dict[str, Any]:
        """Its name and parameters."""
        return {"method": "persistence", **asdict(self.persistence)}

    def __reduce__(self) -> tuple[type[Self], tuple[Persistence, int], dict[str, Any]]:
        # A copy, as in another process, begins a recording of its own.
        return type(self), (self.persistence, self.threads), {"warns": self.warns}

    def _end_recording(self) -> None:
        self._recent = PlacedFrames(self.window, self.threads)
        self._points: WeakKeyDictionary[Scan, ScanPoints] = WeakKeyDictionary()

    def _judged(self, scans: WindowOfScans, stopwatch: Stopwatch) -> Judgement:
        frame, scan = scans.judged.frame, scans.judged.scan
        with stopwatch.stage("view"):
            for one in (scans.judged, *scans.before, *scans.after):
                if one.scan not in self._points:
                    self._points[one.scan] = ScanPoints(one.scan, self.threads)
        points = self._points[scan]
        with stopwatch.stage("network"):
            alone = surroundings_log_odds(points)
            evidence = self._evidence(scans, alone < 0)
            if evidence is not None:
                alone = combined_log_odds(alone, evidence)
            agreed = vote(points, alone)
            sure = np.log(self.persistence.sure)
            surely_rain = (alone > sure) & (agreed > sure)
            surely_solid = (alone < -sure) & (agreed < -sure)
            known = (surely_rain | surely_solid) & (evidence is not None)
        with stopwatch.stage("back"):
            return _by_row(scan, points, agreed, known, frame)

    def _evidence(self, scans: WindowOfScans, solid: Bools) -> RayEvidence | None:
        """The evidence of the rays of the other scans; None if no scan matches.

        Args:
            scans: The scan that is judged, and those around it.
            solid: True for points of it that are solid by their surroundings, bool (M,).
        """
        scan, alike, found = scans.judged.scan, [], []
        for other in (*scans.before, *scans.after):
            transform = scans.judged.to(other)
            if transform is not None and len(self._points[other.scan]):
                found.append(self._points[scan].evidence_of(self._points[other.scan], transform))
                if is_alike(scan, other.scan, found[-1][solid]):
                    alike.append(found[-1])
        if found and not alike:
            self._recent.doubts[scan].append(UNLIKE)
        return mean_evidence(alike) if alike else None


def _by_row(
    scan: Scan, points: ScanPoints, log_odds: Floats, known: Bools, frame: Frame
) -> Judgement:
    """The judgement of the rows of a scan, by that of its points."""
    # The last value is for rows that cannot be judged, whose point is -1.
    log_odds = np.append(log_odds, -np.inf)[points.inverse]
    sure = np.append(known, False)[points.inverse]
    probability = (1 / (1 + np.exp(-log_odds))).astype(np.float32)
    return Judgement(probability, log_odds > 0, points.inverse >= 0, scan, frame, sure)
