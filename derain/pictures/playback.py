"""Writes a recording for Rerun's viewer: scans over time, their labels, and what methods find."""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import rerun
from tqdm import tqdm

from derain.errors import InputError, printable
from derain.pictures import entities, palette
from derain.pictures.entities import MethodEntities
from derain.pictures.playback_layout import layout, write_static
from derain.pictures.recording_file import RecordingFile, recording_file
from derain.pictures.selection import PER_METRE, LabelledRain, Labels, Selection
from derain.scan import Bools, Scan
from derain.sources.frame import Frame
from derain.sources.judgement import Judgement
from derain.sources.judging import Guard, judgements, unguarded
from derain.sources.method import Method

# Points that are less probably rain, most of a scan, are not written among the probabilities.
LEAST_PROBABILITY = 0.01

# Names of the palette's colours.
COLOUR_NAMES = dict(zip(palette.OUTCOMES.values(), ("grey", "blue", "yellow", "red"), strict=True))

PROBABILITY_TEXT = "Probability of rain: from dark (low) over blue to white (high)"


def write_playback(
    path: Path,
    selection: Selection,
    methods: Mapping[str, Method],
    labels: Labels | None = None,
    guard: Guard = unguarded,
    watch: Callable[[str, Judgement], None] = lambda title, judgement: None,
) -> None:
    """Writes a file for Rerun's viewer.

    The scans are read once more for every method, so that only a few are in memory however long
    the recording is. A scan that cannot be read or judged is shown empty.

    Args:
        path: The file, ``.rrd``.
        selection: The scans to show.
        methods: Methods by their titles.
        labels: Labels of the scans; None where they have none or no data card explains them.
        guard: Context of the work on each scan, which may hold back its error.
        watch: Called with the method's title and each judgement that is written.

    Raises:
        InputError: The file cannot be written; no scan can be read; one cannot, and the guard does
            not hold the error back.
    """
    first = selection.frames[0]
    name = printable(first.sequence or Path(first.name).name)
    opened_with = layout(methods, labels, placed=bool(selection.poses))
    with recording_file(path, name, opened_with) as file:
        write_static(file, labels, methods)
        writer = PlaybackWriter(file, selection, labels)
        _write_scans(writer, selection, guard)
        for title, method in methods.items():
            for frame in selection.frames:
                writer.begin(frame, MethodEntities(title).all)
            frames = tqdm(selection.for_method(method), title, unit="scan", disable=None)
            for frame, judgement, _ in judgements(method, frames, guard):
                if frame.key in selection.number_of:
                    with guard(frame):
                        writer.write_judgement(title, method, judgement)
                        watch(title, judgement)
                    file.flush()


def _write_scans(writer: "PlaybackWriter", selection: Selection, guard: Guard) -> None:
    written = False
    for frame in tqdm(selection.frames, "scans", unit="scan", disable=None):
        writer.begin(frame, entities.SCAN, entities.RANGES, entities.CAPTION)
        with guard(frame):
            writer.write_scan(frame)
            written = True
        writer.file.flush()
    if not written:
        first = selection.frames[0]
        raise InputError(first.name, "there is nothing to show: no scan can be read", "See above.")


@dataclass(frozen=True, eq=False)
class PlaybackWriter:
    """Writes scans and judgements to their entities.

    Attributes:
        file: The file to write to.
        selection: The scans shown.
        labels: Labels of the scans; None where there are none.
    """

    file: RecordingFile
    selection: Selection
    labels: Labels | None

    def begin(self, frame: Frame, *paths: str) -> None:
        """Clears entities at a frame, so that what the frame before has there does not stay.

        What is logged at the frame afterwards is shown.
        """
        self._set_time(frame)
        for path in paths:
            self.file.log(path, rerun.Clear(recursive=True))

    def write_scan(self, frame: Frame) -> None:
        """Writes a scan with its pose and its labels, for a frame that has begun.

        Raises:
            InputError: A scan or labels that cannot be read.
        """
        scan = frame.read()
        labelled = None if self.labels is None else self.labels.of(frame, scan)
        text = caption(frame, scan, None if labelled is None else self.labels)
        self.file.log(entities.CAPTION, rerun.TextDocument(text, media_type="text/markdown"))
        if frame.key in self.selection.poses:
            pose = self.selection.poses[frame.key]
            placed = rerun.Transform3D(translation=pose[:3, 3], mat3x3=pose[:3, :3])
            self.file.log(entities.SENSOR, placed)
        look = self.selection.look
        colours = look.colours(scan)[scan.valid]
        self.file.log(entities.POINTS, rerun.Points3D(scan.xyz[scan.valid], colors=colours))
        if look.view is not None:
            ranges, span = look.centimetres(look.view(scan)), (0, look.farthest * PER_METRE)
            image = rerun.DepthImage(
                ranges, meter=PER_METRE, colormap="grayscale", depth_range=span
            )
            self.file.log(entities.RANGES, image)
        if self.labels is not None and labelled is not None:
            self._write_labels(self.labels, scan, labelled)

    def write_judgement(self, title: str, method: Method, judgement: Judgement) -> None:
        """Writes what a method finds in a scan.

        Args:
            title: Title of the method.
            method: The method.
            judgement: Its judgement of a frame that is shown.

        Raises:
            InputError: Labels that cannot be read.
        """
        frame, scan, rain = judgement.frame, judgement.scan, judgement.rain
        assert frame is not None  # the method was given frames, not points
        place = MethodEntities(title)
        labelled = None if self.labels is None else self.labels.of(frame, scan)
        # Where the truth is not known, what was called rain counts as rain.
        truth = rain if labelled is None else np.where(labelled.known, labelled.rain, rain)
        classed = palette.outcomes(rain, truth).astype(np.uint16)
        self._set_time(frame)
        for entity, rows in ((place.kept, scan.valid & ~rain), (place.removed, rain)):
            self.file.log(entity, rerun.Points3D(scan.xyz[rows], class_ids=classed[rows]))
        if method.gives_probabilities:
            rows = judgement.probability >= LEAST_PROBABILITY
            colours = palette.shades(palette.PROBABILITY, judgement.probability[rows])
            self.file.log(place.probability, rerun.Points3D(scan.xyz[rows], colors=colours))
        self._write_share(place.share, rain, scan)

    def _write_labels(self, labels: Labels, scan: Scan, found: LabelledRain) -> None:
        shown = scan.valid & (found.rain | ~found.known)
        classed = np.where(found.rain[shown], entities.CLASS_RAIN, entities.CLASS_NOT_KNOWN)
        points = rerun.Points3D(scan.xyz[shown], class_ids=classed.astype(np.uint16))
        self.file.log(labels.points, points)
        self._write_share(labels.share, found.rain, scan)

    def _write_share(self, entity: str, part: Bools, scan: Scan) -> None:
        """Writes the share of the valid points, per cent, that a part of them is."""
        if scan.valid.any():
            self.file.log(entity, rerun.Scalars(100 * np.mean(part[scan.valid])))

    def _set_time(self, frame: Frame) -> None:
        """Dates all that is logged from here on to a frame."""
        stream, seconds = self.file.stream, self.selection.seconds.get(frame.key)
        stream.reset_time()
        stream.set_time(entities.FRAME, sequence=self.selection.number_of[frame.key])
        if seconds is not None:
            stream.set_time(entities.TIME, duration=seconds)


def caption(frame: Frame, scan: Scan, labels: Labels | None) -> str:
    """Text beside a scan, in Markdown: which scan it is, and what the colours mean.

    Args:
        frame: The frame.
        scan: Its scan.
        labels: The labels that its rain is known by; None where it has none.
    """
    which = f"**{_escaped(frame.key)}**, {len(scan):,} points"
    coloured = palette.OUTCOMES if labels else palette.WITHOUT_LABELS
    meanings = "\n".join(
        f"- {COLOUR_NAMES[colour]}: {meaning}" for meaning, colour in coloured.items()
    )
    return f"{which}\n\n{meanings}\n\n{_meaning_of_rain(labels)} {PROBABILITY_TEXT}.\n"


def _meaning_of_rain(labels: Labels | None) -> str:
    if labels is None:
        return "No labels: the true rain is unknown."
    if not labels.card.unknown:
        return f"Rain means rain by the {labels.name}."
    return f"Rain means rain by the {labels.name}; in its own view, undecided points are yellow."


def _escaped(text: str) -> str:
    """A name with Markdown's marks escaped."""
    return "".join(f"\\{c}" if c in "\\`*_{}[]<>()#+-!|" else c for c in printable(text))
