"""Writes a recording to look at: scans over time, and what methods make of them."""

from collections.abc import Callable, Mapping
from pathlib import Path

from tqdm import tqdm

from derain.errors import InputError
from derain.playback.caption import file_name
from derain.playback.labels import Labels
from derain.playback.lasting import write_what_lasts
from derain.playback.layout import layout
from derain.playback.recording_file import recording_file
from derain.playback.selection import Selection
from derain.playback.sensor_look import SensorLook
from derain.playback.size import refuse_too_large
from derain.playback.writer import PlaybackWriter
from derain.sources.judgement import Judgement
from derain.sources.judging import Guard, judgements, unguarded
from derain.sources.method import Method

# Told of each judgement that is shown, with the title of its method.
Watch = Callable[[str, Judgement], None]


def write_playback(
    path: Path,
    selection: Selection,
    look: SensorLook,
    methods: Mapping[str, Method],
    labels: Labels | None = None,
    guard: Guard = unguarded,
    watch: Watch = lambda title, judgement: None,
) -> None:
    """Writes a file that Rerun's viewer shows.

    The scans are read once more for every method, so that no more than a few are in memory however
    long the recording is. Where a scan cannot be read or judged, it is shown as if it were empty.

    Args:
        path: The file, ``.rrd``.
        selection: The scans that are shown.
        look: How they are drawn.
        methods: What judges them, by titles.
        labels: Labels that lie with the scans; None where nobody says what they mean.
        guard: Surrounds the work on each scan, where an error is not to end it all.
        watch: Is told of each judgement.

    Raises:
        InputError: A file that cannot be written; not one scan that can be read; one that cannot,
            where the guard lets that through.
    """
    refuse_too_large(path, look.expected_bytes(len(selection.frames), len(methods)))
    opened_with = layout(methods, labels, placed=bool(selection.poses))
    with recording_file(path, file_name(selection.frames[0]), opened_with) as file:
        write_what_lasts(file, selection, labels, methods)
        writer = PlaybackWriter(file, selection, look, labels)
        _write_scans(writer, selection, guard)
        for title, method in methods.items():
            _write_judgements(writer, selection, title, method, guard, watch)


def _write_scans(writer: PlaybackWriter, selection: Selection, guard: Guard) -> None:
    written = 0
    for frame in tqdm(selection.frames, "scans", unit="scan", disable=None):
        before = written
        with guard(frame):
            writer.write_scan(frame)
            written += 1
        if written == before:
            writer.write_no_scan(frame)
    if not written:
        first = selection.frames[0]
        raise InputError(first.name, "there is nothing to show: no scan can be read", "See above.")


def _write_judgements(
    writer: PlaybackWriter,
    selection: Selection,
    title: str,
    method: Method,
    guard: Guard,
    watch: Watch,
) -> None:
    missing = {frame.key: frame for frame in selection.frames}
    frames = tqdm(selection.for_method(method), title, unit="scan", disable=None)
    for frame, judgement, _ in judgements(method, frames, guard):
        if frame.key in missing:
            with guard(frame):
                writer.write_judgement(title, method, judgement)
                watch(title, judgement)
                del missing[frame.key]
    for frame in missing.values():
        writer.write_no_judgement(title, frame)
