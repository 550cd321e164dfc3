"""Labels for points without one, such as a radar's: that of the nearest labelled point."""

import numpy as np
import small_gicp
from numpy.typing import NDArray

from derain.errors import InputError
from derain.scan import Scan
from derain.system.cores import usable_cores
from derain.views.morton import distinct_rows

# Id that stands for "class not known". No class of REHEARSE-3D has it; in SemanticKITTI and WADS,
# which have no radar to transfer labels to, it is that of moving motorcyclists.
UNKNOWN = 255

# How far a label reaches by default, metres, a modelling choice: about the size of an automotive
# radar's cell at 50 m (1 degree across, some decimetres deep). Within it a detection may well be of
# what the LiDAR saw; beyond it the two saw different things.
LABEL_WITHIN = 1.0


def transfer_labels(
    labelled: Scan, xyz: NDArray[np.float32], within: float = LABEL_WITHIN
) -> NDArray[np.int64]:
    """Labels points by the nearest valid point of a labelled scan.

    Where several rows of the scan lie at one position, the label of the first of them counts.

    Args:
        labelled: A scan with labels.
        xyz: The points to label, float32 (N, 3), metres, in the frame of the scan.
        within: How far away the nearest point may be, metres, inclusive.

    Returns:
        Semantic class ids, int64 (N,); ``UNKNOWN`` where nothing is so near, and for points that
        cannot be judged.

    Raises:
        InputError: A scan without labels.

    Source: REHEARSE-3D, section III.B, step 10, which states no bound on the distance.
    """
    if labelled.label is None:
        raise InputError(labelled.name, "it has no labels", "Give its label file.")
    label = np.full(len(xyz), UNKNOWN, np.int64)
    # Only the first row at each position is searched: of several rows that are equally near, a
    # kd-tree may find any.
    source, _ = distinct_rows(labelled)
    asked = np.flatnonzero(Scan(xyz).valid)
    if len(source) and len(asked):
        threads = usable_cores()
        tree = small_gicp.KdTree(labelled.xyz[source].astype(np.float64), num_threads=threads)
        nearest, squared = tree.batch_knn_search(xyz[asked].astype(np.float64), 1, threads)
        near = squared[:, 0] <= within**2
        label[asked[near]] = labelled.label[source[nearest[near, 0]]]
    return label
