"""A folder of labels alone."""

import os
from collections.abc import Iterable, Iterator
from pathlib import Path

from derain.errors import InputError
from derain.files.labels import LABEL, label_beside
from derain.files.names import beside
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.sources.sink import FolderSink


class LabelSink(FolderSink):
    """A folder of labels alone, ``<key>.label``.

    They may lie with the scans, and where the labels of scans are looked for: whoever writes no
    scans may be labelling these. Labels that are there already stay.

    Args:
        folder: The folder, made if missing.
        option: What a user calls it, for messages.
    """

    def refuse_clashes(self, source: Iterable[Frame]) -> None:
        """Refuses to overwrite labels that are there, or one result by another."""
        frames = list(source)
        # Not Path.is_file, which raises where the name has become too long by its suffix.
        there = {os.path.realpath(label) for label in _labels_of(frames) if os.path.isfile(label)}
        for frame in frames:
            target = self.path(frame, LABEL)
            if os.path.realpath(target) in there:
                raise InputError(
                    self.folder,
                    f"what is found for {frame.name} would overwrite the labels {target}",
                    f"Give {self.option} another folder.",
                )
        super().refuse_clashes(frames)

    def _refuse_own_files(self, frame: FileFrame) -> None:
        """No scan is written, and of labels only those matter that are there."""


def _labels_of(frames: Iterable[Frame]) -> Iterator[Path]:
    """Where the labels of files are, or would be looked for."""
    for frame in frames:
        if isinstance(frame, FileFrame):
            places = (frame.label_path, label_beside(frame.path), beside(frame.path, LABEL))
            yield from filter(None, places)
