"""Folders for the results of frames; each file is named by the key of its frame."""

import os
from collections.abc import Iterable
from functools import lru_cache
from pathlib import Path

from derain.cards.known import label_places
from derain.errors import InputError
from derain.files import write_scan
from derain.files.labels import LABEL, write_labels
from derain.files.names import beside
from derain.scan import Array, Scan
from derain.sources.file_frame import FileFrame
from derain.sources.frame import Frame
from derain.stores.url import url_of


class FolderSink:
    """A folder of files: ``<key>`` with the suffix of the frame's file, and ``<key>.label``.

    Args:
        folder: The folder, made if missing.
        option: The user's name for it, for messages.
    """

    def __init__(self, folder: Path, option: str = "--out") -> None:
        self.folder = folder
        self.option = option

    def scan_path(self, frame: Frame) -> Path:
        """The file that a scan is written to; one that came from no file is written as a PCD."""
        return self.folder / f"{frame.key}{frame.suffix or '.pcd'}"

    def path(self, frame: Frame, suffix: str) -> Path:
        """The file for any other result of a scan, such as its labels."""
        return self.folder / f"{frame.key}{suffix}"

    def refuse_clashes(self, source: Iterable[Frame]) -> None:
        """Refuses, before any work, to overwrite a scan or labels of the source, or one result.

        Raises:
            InputError: The results of a frame would overwrite a scan, labels, or the results of
                another frame; or a frame is a file of labels, or named twice.
        """
        _real_folder.cache_clear()
        written: dict[str, Frame] = {}
        for frame in source:
            if frame.suffix == LABEL:
                remedy = "Name the scans alone, such as scans/*.bin, or their folder."
                raise InputError(frame.name, "is a file of labels, not a scan", remedy)
            if isinstance(frame, FileFrame):
                self._refuse_own_files(frame)
            target = self.path(frame, LABEL)
            other = written.setdefault(_real(target), frame)
            if other is not frame:
                files = [_real(one.path) for one in (frame, other) if isinstance(one, FileFrame)]
                if len(set(files)) < len(files):
                    raise InputError(frame.name, "is named twice", "Name each scan once.")
                raise InputError(
                    frame.name,
                    f"another scan has the same name: its results and those of {other.name} would "
                    f"both be {url_of(target)}",
                    f"Take them in two runs, each to its {self.option}.",
                )

    def write(self, frame: Frame, scan: Scan | None, label: Array) -> None:
        """Writes the scan, then the labels: if the labels exist, the scan is complete.

        Args:
            frame: The frame.
            scan: The cleaned scan; None where only labels are of interest.
            label: Class ids or a bool mask of the scan that the labels are for, (N,).

        Raises:
            InputError: It cannot be written.
        """
        if scan is not None:
            write_scan(self.scan_path(frame), scan)
        write_labels(self.path(frame, LABEL), label)

    def refuse_own_scan(self, frame: FileFrame) -> None:
        """Refuses to write a scan over the one that it is made of."""
        if _real(self.scan_path(frame)) == _real(frame.path):
            raise self._refused(f"would overwrite {frame.name}")

    def _refuse_own_files(self, frame: FileFrame) -> None:
        self.refuse_own_scan(frame)
        # Results that lie where labels are looked for would be taken for the truth.
        target = _real(self.path(frame, LABEL))
        places = (frame.label_path, beside(frame.path, LABEL), *label_places(frame.path))
        if any(labels is not None and _real(labels) == target for labels in places):
            raise self._refused(f"holds the labels of {frame.name}")

    def _refused(self, reason: str) -> InputError:
        return InputError(url_of(self.folder), reason, f"Give {self.option} another folder.")


def _real(path: Path) -> str:
    """The path of a file or folder without symbolic links."""
    folder, name = os.path.split(path)
    real = os.path.join(_real_folder(folder), name)
    return os.path.realpath(path) if name in ("", "..") or os.path.islink(real) else real


@lru_cache(maxsize=1024)
def _real_folder(folder: str) -> str:
    """The path of a folder without symbolic links; a hundred thousand scans may lie in one."""
    return os.path.realpath(folder)
