"""Where the scans and labels of a data set lie."""

from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Layout:
    """Where scans and labels lie: ``root/<sequences>/<sequence>/<scans>/<frame>.bin``.

    Attributes:
        sequences: Name of the folder of sequences.
        scans: Name of a sequence's folder of scans.
        labels: Name of a sequence's folder of labels, ``<frame>.label``.
    """

    sequences: str = "sequences"
    scans: str = "velodyne"
    labels: str = "labels"


# Source: github.com/PRBonn/semantic-kitti-api, README; WADS has it as well.
SEMANTIC_KITTI = Layout()

# Source: sporsho/sporsho.github.io, REHEARSE3D.md.
REHEARSE3D = Layout(scans="lidar_radar_pcd", labels="lidar_radar_labels")


def sequence_of(scan: Path) -> str:
    """Name of the sequence that a scan lies in: ``<sequence>/<folder of scans>/<frame>.bin``."""
    return scan.absolute().parent.parent.name
