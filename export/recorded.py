"""A model over a recording: its answers for each scan, with the rays of the scans around it."""

from collections.abc import Iterator, Sequence
from dataclasses import replace
from hashlib import sha256
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np

from derain.errors import InputError
from derain.export.runtime import Derainer
from derain.recordings.placing import UNLIKE, PlacedFrames, PlacedMethod, is_alike
from derain.recordings.rays import RayEvidence, Rays, mean_evidence, ray_evidence
from derain.scan import Float32s, Floats, Ints, Scan
from derain.sources.judgement import Judgement
from derain.sources.window import Window, WindowOfScans
from derain.system.stopwatch import Stopwatch
from derain.views.morton import evenly
from derain.views.scan_issues import ScanIssue

# Points to which a model gives a lower probability keep it: hardly any of them is rain.
DOUBTFUL = 0.01

# Log-odds of rain that rays of other scans add to those of the model, fitted to simulated drives by
# benchmarks/persistence_weights.py: for the share of them that ends at something solid at a place,
# and for the share that went through it.
OF_ENDING, OF_THROUGH = -10.32, 0.61

# The end of a ray of these log-odds of rain, by the model, counts half as something solid; fitted
# together with the weights.
HALF_SOLID = 1.0

# A judgement of another scan by itself, and what takes the frame of the scan that is judged to that
# of the other, float64 (4, 4), metres.
PlacedJudgement = tuple[Judgement, Floats]

# Number of points, solid by the model, that a pose is checked at: more rays of another scan have to
# end at them than go through them, or else a pose is wrong.
CHECKED = 2000


class RecordedDerainer(PlacedMethod):
    """Judges the scans of a recording by a model, and by the rays of the scans around each.

    Rays of another scan that end where a point is show something solid there, the less the likelier
    their own ends are rain by the model. Those that went through the place show that nothing was.
    Where the sensor was comes from the poses of the frames, or else from odometry. A scan of which
    that is not known, or whose pose does not match what it shows, is judged alone. Rays of a scan
    that the model cannot judge show nothing; its own error names it. Its stages are those of the
    model, odometry and rays.

    Example:
        >>> derainer = RecordedDerainer(Derainer("model.onnx"), past=1)
        >>> [len(derainer.push(frame).rain) for frame in derain.named_frames("scan.bin")]
        [820]

    Args:
        model: Model that judges a scan alone.
        past: Scans before the one that is judged.
        delay: Scans after it, which it has to wait for.

    Raises:
        InputError: Other numbers of scans than 0 to 50.
    """

    def __init__(self, model: Derainer, past: int = 1, delay: int = 0) -> None:
        self.model = model
        self.warns = model.warns
        self._window = Window(past, delay)
        self._end_recording()

    @property
    def window(self) -> Window:
        """The scans before and after the one that it judges."""
        return self._window

    def fingerprint(self) -> str:
        """A fingerprint of the model, and of the number of scans around one that it sees."""
        seen = f"{self.model.fingerprint()} {self.window.before} {self.window.after}"
        return sha256(seen.encode()).hexdigest()[:16]

    def issues(self, judgement: Judgement) -> Iterator[ScanIssue]:
        """Warnings about a scan for the model, and about the scans around it."""
        yield from self.model.issues(judgement)
        yield from self._recent.warnings(judgement.scan)

    def as_dict(self) -> dict[str, Any]:
        """The model's name, its threshold, and the number of scans that it sees around one."""
        return self.model.as_dict() | {"past": self.window.before, "delay": self.window.after}

    def __reduce__(self) -> tuple[Any, ...]:
        # A copy, as in another process, begins a recording of its own.
        return (
            type(self),
            (self.model, self.window.before, self.window.after),
            {"warns": self.warns},
        )

    def _end_recording(self) -> None:
        self._recent = PlacedFrames(self.window, self.model.threads)
        self._rays: WeakKeyDictionary[Scan, Rays] = WeakKeyDictionary()
        self._alone: dict[Scan, Judgement | None] = {}

    def _judged(self, scans: WindowOfScans, stopwatch: Stopwatch) -> Judgement:
        scan = scans.judged.scan
        seen = [one.scan for one in (scans.judged, *scans.before, *scans.after)]
        # Of no scan that is not seen any more: each judgement holds its scan.
        self._alone = {one: self._alone_of(one, stopwatch) for one in seen}
        alone = self._alone[scan]
        if alone is None:
            alone = self.model.judge_silently(scan, stopwatch)  # which raises the reason
        with stopwatch.stage("rays"):
            probability = self._with_rays(alone, scans)
        rain = probability > self.model.spec.threshold
        return replace(alone, probability=probability, rain=rain, frame=scans.judged.frame)

    def _with_rays(self, alone: Judgement, scans: WindowOfScans) -> Float32s:
        """Probabilities of rain by the model and by the rays of other scans, float32 (N,)."""
        doubtful = np.flatnonzero(alone.probability > DOUBTFUL)
        others = self._placed_others(scans)
        solid = evenly(np.flatnonzero(alone.judged & (alone.probability <= DOUBTFUL)), CHECKED)
        if not (others and len(solid)):
            return alone.probability
        evidence = self._evidence(alone.scan, solid, doubtful, others)
        if evidence is None:
            self._recent.doubts[alone.scan].append(UNLIKE)
            return alone.probability
        probability = alone.probability.copy()
        certain = np.finfo(np.float64).eps
        before = np.clip(probability[doubtful].astype(np.float64), certain, 1 - certain)
        log_odds = np.log(before / (1 - before)) + added_log_odds(evidence)
        probability[doubtful] = 1 / (1 + np.exp(-log_odds))
        return probability

    def _placed_others(self, scans: WindowOfScans) -> list[PlacedJudgement]:
        """The scans around one that are judged and whose place is known."""
        found = []
        for other in (*scans.before, *scans.after):
            judgement, to_other = self._alone[other.scan], scans.judged.to(other)
            if judgement is not None and to_other is not None and len(self._rays_of(other.scan)):
                found.append((judgement, to_other))
        return found

    def _evidence(
        self, scan: Scan, solid: Ints, doubtful: Ints, others: Sequence[PlacedJudgement]
    ) -> RayEvidence | None:
        """Evidence of the rays of other scans at the doubtful points; None if no scan matches.

        Args:
            scan: The scan.
            solid: Rows of points that the model takes for solid, int64 (Q,), one or more.
            doubtful: Rows of the doubtful points, int64 (D,).
            others: Other scans as they are judged alone, and what takes the frame of this one to
                theirs.
        """
        found = []
        rows = np.concatenate([solid, doubtful])
        for other, transform in others:
            places = scan.xyz[rows] @ transform[:3, :3].T + transform[:3, 3]
            rays, step = self._rays_of(other.scan), self._rays_of(scan).step
            solid_ends = solidity(other.probability[rays.rows])
            seen = ray_evidence(places, rays, step, solid_ends)
            if is_alike(scan, other.scan, seen[: len(solid)]):
                found.append(seen[len(solid) :])
        return mean_evidence(found) if found else None

    def _alone_of(self, scan: Scan, stopwatch: Stopwatch) -> Judgement | None:
        """The judgement of a scan by itself, which is made once; None where the model fails."""
        if scan in self._alone:
            return self._alone[scan]
        try:
            return self.model.judge_silently(scan, stopwatch)
        except InputError:
            return None

    def _rays_of(self, scan: Scan) -> Rays:
        if scan not in self._rays:
            self._rays[scan] = Rays.of(scan, self.model.threads)
        return self._rays[scan]


def solidity(probability: Float32s, half: float = HALF_SOLID) -> Floats:
    """How far ends of rays count as something solid, 0..1, float64 (R,).

    Args:
        probability: Probabilities of rain of these ends by the model, float32 (R,).
        half: Log-odds of rain of an end that counts half.
    """
    rain = probability.astype(np.float64)
    solid: Floats = (1 - rain) / (1 - rain + rain * np.exp(-half))
    return solid


def added_log_odds(evidence: RayEvidence) -> Floats:
    """Log-odds of rain by the rays of other scans, float64 (M,); 0 where none is near."""
    return OF_ENDING * evidence.ending + OF_THROUGH * evidence.through
