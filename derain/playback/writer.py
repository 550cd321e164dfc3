"""What is written of each scan: its points, what labels say of them, and what methods do."""

import math

import numpy as np
import rerun
from numpy.typing import NDArray

from derain.evaluation.counts import Counts, ratio
from derain.pictures.palette import PROBABILITY, outcomes, shades
from derain.playback.caption import caption
from derain.playback.entities import (
    CAPTION,
    CLASS_KEPT,
    CLASS_MISSED,
    CLASS_NOT_KNOWN,
    CLASS_RAIN,
    NOTHING,
    POINTS,
    RANGES,
    SCAN,
    SENSOR,
    OfMethod,
    class_of,
)
from derain.playback.labels import LabelledRain, Labels
from derain.playback.recording_file import RecordingFile
from derain.playback.selection import Selection
from derain.playback.sensor_look import PER_METRE, SensorLook
from derain.scan import Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.method import Method

# Points that are less probably rain are not written again as such: they are most of them.
LEAST_PROBABILITY = 0.01


class PlaybackWriter:
    """Writes scans and judgements where they stand.

    Args:
        file: Where to.
        selection: What is shown.
        look: How it is drawn.
        labels: Labels that lie with the scans; None where nobody says what they mean.
    """

    def __init__(
        self, file: RecordingFile, selection: Selection, look: SensorLook, labels: Labels | None
    ) -> None:
        self.file = file
        self.selection = selection
        self.look = look
        self.labels = labels

    def write_scan(self, frame: Frame) -> None:
        """Writes a scan, where it was taken, and what labels say of it.

        Raises:
            InputError: A scan or labels that cannot be read.
        """
        scan = frame.read()
        labelled = None if self.labels is None else self.labels.of(frame, scan)
        self._at(frame)
        by = None if labelled is None else self.labels
        text = caption(frame, scan, by, frame.key in self.selection.held_out)
        self.file.log(CAPTION, rerun.TextDocument(text, media_type="text/markdown"))
        if frame.key in self.selection.poses:
            pose = self.selection.poses[frame.key]
            self.file.log(SENSOR, rerun.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3]))
        colours = self.look.colours(scan)[scan.valid]
        self.file.log(POINTS, rerun.Points3D(scan.xyz[scan.valid], colors=colours))
        if self.look.view is not None:
            self.file.log(
                RANGES,
                rerun.DepthImage(
                    self.look.centimetres(self.look.view(scan)),
                    meter=PER_METRE,
                    colormap="grayscale",
                    depth_range=(0, self.look.farthest * PER_METRE),
                ),
            )
        if self.labels is not None:
            self._write_labels(self.labels, scan, labelled)
        self.file.flush()

    def write_judgement(self, title: str, method: Method, judgement: Judgement) -> None:
        """Writes what a method says of a scan.

        Args:
            title: What the method is called.
            method: The method.
            judgement: What it says of a frame that is shown.

        Raises:
            InputError: Labels that cannot be read.
        """
        frame, scan, rain = judgement.frame, judgement.scan, judgement.rain
        assert frame is not None  # a frame was pushed, not points
        stand_at = OfMethod(title)
        labelled = None if self.labels is None else self.labels.of(frame, scan)
        classed = class_of(outcomes(rain, _truth(labelled, rain)))
        self._at(frame)
        for path, rows in ((stand_at.kept, scan.valid & ~rain), (stand_at.removed, rain)):
            self.file.log(path, rerun.Points3D(scan.xyz[rows], class_ids=classed[rows]))
        if self.labels is not None:
            self._write_errors(stand_at, judgement, labelled)
        if method.gives_probabilities:
            rows = judgement.probability >= LEAST_PROBABILITY
            colours = shades(PROBABILITY, judgement.probability[rows])
            self.file.log(stand_at.probability, rerun.Points3D(scan.xyz[rows], colors=colours))
        if self.look.view is not None:
            winner = self.look.view(scan).winner
            coloured = np.append(np.where(classed == CLASS_KEPT, NOTHING, classed), NOTHING)
            image = coloured[winner].reshape(self.look.view.grid.rows, -1)
            self.file.log(stand_at.image, rerun.SegmentationImage(image.astype(np.uint8)))
        self._share(stand_at.share, rain, scan)
        self.file.flush()

    def write_no_scan(self, frame: Frame) -> None:
        """Writes that there is nothing to see, so that the scan before does not stay."""
        self._at(frame)
        for path in (SCAN, RANGES, CAPTION):
            self.file.log(path, rerun.Clear(recursive=True))

    def write_no_judgement(self, title: str, frame: Frame) -> None:
        """Writes that a method says nothing of a scan."""
        self._at(frame)
        stand_at = OfMethod(title)
        for path in (stand_at.all, stand_at.image, stand_at.share, stand_at.iou):
            self.file.log(path, rerun.Clear(recursive=True))

    def _write_labels(self, labels: Labels, scan: Scan, found: LabelledRain | None) -> None:
        stand_at = labels.stand_at
        if found is None:
            for path in (stand_at.points, stand_at.share, stand_at.share_not_known):
                self.file.log(path, rerun.Clear(recursive=True))
            return
        told = scan.valid & (found.rain | ~found.known)
        classed = np.where(found.rain[told], CLASS_RAIN, CLASS_NOT_KNOWN).astype(np.uint16)
        self.file.log(stand_at.points, rerun.Points3D(scan.xyz[told], class_ids=classed))
        self._share(stand_at.share, found.rain, scan)
        if labels.card.unknown:
            self._share(stand_at.share_not_known, ~found.known, scan)

    def _write_errors(
        self, stand_at: OfMethod, judgement: Judgement, found: LabelledRain | None
    ) -> None:
        """Writes the rain that a method leaves, to be drawn large, and its IoU."""
        if found is None:
            for path in (stand_at.missed, stand_at.iou):
                self.file.log(path, rerun.Clear(recursive=False))
            return
        scan, rain = judgement.scan, judgement.rain
        judged = scan.valid & found.known
        missed = scan.xyz[judged & found.rain & ~rain]
        self.file.log(stand_at.missed, rerun.Points3D(missed, class_ids=CLASS_MISSED))
        self._number(stand_at.iou, Counts.of(rain[judged], found.rain[judged]).iou)

    def _share(self, path: str, part: NDArray[np.bool_], scan: Scan) -> None:
        """Writes which share some points are of those that can be judged, per cent."""
        whole = np.count_nonzero(scan.valid)
        self._number(path, 100 * float(ratio(np.count_nonzero(part & scan.valid), whole)))

    def _number(self, path: str, value: float) -> None:
        """Writes a number of a line; where it is undefined, the line has a gap."""
        undefined = math.isnan(value)
        self.file.log(path, rerun.Clear(recursive=False) if undefined else rerun.Scalars(value))

    def _at(self, frame: Frame) -> None:
        selection = self.selection
        self.file.at(selection.number_of[frame.key], selection.seconds.get(frame.key))


def _truth(labelled: LabelledRain | None, rain: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """What is rain, bool (N,); of what nobody knows, all that was called so counts."""
    return rain if labelled is None else np.where(labelled.known, labelled.rain, rain)
