"""What each part of persistence gives: IoU with all of it, and without one part or another.

    python benchmarks/persistence_parts.py wads WADS/drive/velodyne
    python benchmarks/persistence_parts.py kitti snowykitti/velodyne
    python benchmarks/persistence_parts.py simulated drives/standing

Counts the distinct points of scans that have one before and one after them. Labels measure alone.
"""

import argparse
from collections import defaultdict
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.labelled import NamedScans
from derain.evaluation.counts import Counts
from derain.methods.persistence import PersistenceDerainer
from derain.odometry.posed import with_poses
from derain.persistence.evidence import of_rays, of_surroundings, together
from derain.persistence.points import ScanPoints
from derain.persistence.rays import RayEvidence, ask_rays, mean_evidence
from derain.persistence.vote import vote
from derain.sources.frame import Frame
from derain.sources.recordings import recordings_of
from derain.system.cores import usable_cores
from derain.views.morton import distinct_rows

LogOdds = NDArray[np.float64]
