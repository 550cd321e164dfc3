"""The layout of a data set: its folders of scans and labels."""

import os
from dataclasses import dataclass
from pathlib import Path

from derain.files.documents import Entry
from derain.files.labels import LABEL
from derain.files.names import scan_stem


@dataclass(frozen=True)
class Layout:
    """Folders of scans and labels: ``root/<sequences>/<sequence>/<scans>/<frame>.bin``.

    Its defaults are the names of SemanticKITTI, which most data sets have taken over.

    Attributes:
        sequences: Name of the folder of sequences.
        scans: Name of a sequence's folder of scans.
        labels: Name of a sequence's folder of labels, ``<frame>.label``.
        lidar: Name of the folder of the LiDAR's own scans, where ``scans`` holds them merged with
            a radar's; empty where there is none.

    Source: github.com/PRBonn/semantic-kitti-api, README.
    """

    sequences: str = "sequences"
    scans: str = "velodyne"
    labels: str = "labels"
    lidar: str = ""

    @classmethod
    def of(cls, entry: Entry) -> "Layout":
        """The layout on a data card.

        Raises:
            InputError: Something that is not a layout.
        """
        names = dict.fromkeys(("sequences", "scans", "labels", "lidar"), _folder)
        return cls(**entry.record(names))

    def label_of(self, scan: Path) -> Path:
        """Path of the labels of a scan in the folder of scans."""
        beside = scan.parent / os.pardir / self.labels / f"{scan_stem(scan)}{LABEL}"
        return Path(os.path.normpath(beside))


def sequence_of(scan: Path) -> str:
    """Name of the sequence that a scan lies in: ``<sequence>/<folder of scans>/<frame>.bin``."""
    return scan.absolute().parent.parent.name


def _folder(entry: Entry) -> str:
    """The name of a folder, which leads nowhere else."""
    name = entry.text()
    if name in ("", ".", "..") or "/" in name or "\\" in name or "\0" in name:
        raise entry.fault("is not the name of a folder", "Give one name, such as velodyne.")
    return name
