"""LiDAR and 4D radar as one cloud: frames that belong together, how they join, labels for radar."""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np
import small_gicp

from derain.errors import InputError
from derain.files.extrinsics import check_rigid, moved
from derain.scan import Array, Float32s, Floats, Ints, Scan
from derain.system.cores import usable_cores
from derain.views.morton import distinct_rows

# Id that stands for "class not known". No class of REHEARSE-3D has it; in SemanticKITTI and WADS,
# which have no radar to transfer labels to, it is that of moving motorcyclists.
UNKNOWN = 255

# How far a label reaches by default, metres, a modelling choice: about the size of an automotive
# radar's cell at 50 m (1 degree across, some decimetres deep). Within it a detection may well be of
# what the LiDAR saw; beyond it the two saw different things.
LABEL_WITHIN = 1.0

# Columns that every merged file has. No channel of the radar may have one of these names.
MERGED_COLUMNS = ("x", "y", "z", "intensity", "radar")

# The radar frame of a LiDAR scan near whose time none was taken: one without detections.
NO_DETECTIONS = Scan(np.zeros((0, 3), np.float32), name="no radar frame")


def nearest_in_time(times: Floats, among: Floats, within: float) -> Ints:
    """Finds for every time the nearest of others, such as a radar frame for each LiDAR frame.

    Of two that are equally near the earlier is taken, and of equal times the first row.

    Args:
        times: Times, float64 (N,), seconds, in any order.
        among: Times to choose from, float64 (M,), seconds of the same clock, in any order.
        within: Largest distance in time, seconds, inclusive.

    Returns:
        Rows of ``among``, int64 (N,); -1 where none is so near.
    """
    row = np.full(len(times), -1, np.int64)
    if not len(among):
        return row
    ascending, order = np.unique(among, return_index=True)  # of equal times the first row
    after = np.searchsorted(ascending, times).clip(max=len(ascending) - 1)
    before = (after - 1).clip(min=0)
    earlier = np.abs(times - ascending[before]) <= np.abs(ascending[after] - times)
    nearest = np.where(earlier, before, after)
    near = np.abs(times - ascending[nearest]) <= within
    row[near] = order[nearest[near]]
    return row


def fuse(
    lidar: Scan,
    radar: Scan,
    extrinsics: Floats,
    label_within: float = LABEL_WITHIN,
    channels: Sequence[str] = (),
) -> Scan:
    """Joins a LiDAR scan and a radar frame in the LiDAR's frame.

    Args:
        lidar: The LiDAR's scan. With labels, the fused cloud has labels.
        radar: The radar's frame. Its labels are kept; if it has none, each of its points gets that
            of the nearest LiDAR point.
        extrinsics: Takes points of the radar into the LiDAR's frame, float64 (4, 4), metres.
        label_within: Largest distance of a LiDAR point's label, metres.
        channels: Fields of the radar frame to carry along, such as doppler and rcs.

    Returns:
        The rows of the LiDAR in their order, then those of the radar in theirs, distinguished by
        `Scan.radar`; rows that cannot be judged are as they were. Intensity is 0 where the source
        has none. A file of it has the columns of REHEARSE-3D: x, y, z and intensity; with channels
        also ``radar`` (1 or 0) and each of them, float32, NaN for the LiDAR.

    Raises:
        InputError: A channel that the radar frame, not being empty, lacks, or one of
            ``MERGED_COLUMNS``.
        ValueError: A motion that is not rigid.
    """
    check_rigid(extrinsics)
    for name in channels:
        if name in MERGED_COLUMNS:
            raise InputError(name, "is a column of the merged cloud itself", "Leave it out.")
    radar = _moved(radar, extrinsics)
    xyz = np.concatenate([lidar.xyz, radar.xyz])
    intensity = np.concatenate([_intensity(lidar), _intensity(radar)])
    is_radar = np.arange(len(xyz)) >= len(lidar)
    columns: dict[str, Array] = {}
    if channels:
        merged = *xyz.T, intensity, is_radar.astype(np.uint8)
        columns = dict(zip(MERGED_COLUMNS, merged, strict=True))
        columns |= {name: _channel(name, len(lidar), radar) for name in channels}
    label = _label(lidar, radar, label_within)
    return Scan(xyz, intensity, label, is_radar, columns, name=lidar.name)


def transfer_labels(labelled: Scan, xyz: Float32s, within: float = LABEL_WITHIN) -> Ints:
    """Labels points by the nearest valid point of a labelled scan.

    Where several rows of the scan lie at one position, the label of the first of them counts.

    Args:
        labelled: A scan with labels.
        xyz: The points to label, float32 (N, 3), metres, in the frame of the scan.
        within: Largest distance of the nearest point, metres, inclusive.

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
    valid = np.flatnonzero(Scan(xyz).valid)
    if len(source) and len(valid):
        threads = usable_cores()
        tree = small_gicp.KdTree(labelled.xyz[source].astype(np.float64), num_threads=threads)
        nearest, squared = tree.batch_knn_search(xyz[valid].astype(np.float64), 1, threads)
        near = squared[:, 0] <= within**2
        label[valid[near]] = labelled.label[source[nearest[near, 0]]]
    return label


def _moved(scan: Scan, motion: Floats) -> Scan:
    # Rows that cannot be judged stay as they are: a missing return, at the origin, would become a
    # point where the sensor is mounted.
    valid = scan.valid
    xyz = scan.xyz.copy()
    xyz[valid] = moved(xyz[valid], motion)
    return replace(scan, xyz=xyz)


def _intensity(scan: Scan) -> Float32s:
    return np.zeros(len(scan), np.float32) if scan.intensity is None else scan.intensity


def _label(lidar: Scan, radar: Scan, within: float) -> Ints | None:
    if lidar.label is None:
        return None
    if radar.label is None:
        radar = radar.with_label(transfer_labels(lidar, radar.xyz, within))
    return np.concatenate([lidar.label, radar.label])


def _channel(name: str, lidar_points: int, radar: Scan) -> Float32s:
    column = radar.channel(name) if len(radar) else np.zeros(0, np.float32)
    if column is None:
        raise InputError(
            radar.name,
            f"has no column {name} of numbers ({', '.join(radar.fields)})",
            "Name the radar's columns with --radar-columns.",
        )
    return np.concatenate([np.full(lidar_points, np.nan, np.float32), column])
