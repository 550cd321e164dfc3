r"""Merges each LiDAR scan with the radar frame nearest in time, in the layout of REHEARSE-3D.

Each file in lidar_radar_pcd holds the LiDAR's points, then the radar's points in the LiDAR's frame.
With --labels it also writes lidar_radar_labels.

  derain fuse --lidar innoviz --radar radar_pcd --extrinsics radar_to_lidar.yaml --out fused
  derain fuse --lidar innoviz --radar ext_radar --extrinsics radar_to_lidar.yaml \
    --out fused --extra velocity,cross_section
  derain fuse --lidar innoviz --radar radar --extrinsics radar_to_lidar.yaml --out fused \
    --radar-columns x,y,z,doppler,rcs --extra doppler,rcs
  derain fuse --lidar innoviz --radar radar_pcd --extrinsics radar_to_lidar.yaml --out fused \
    --labels innoviz_labels --label-within 0.5

The extrinsics are the pose of the radar in the LiDAR's frame (x forward, y left, z up):

  {x: 0.5, y: 0.0, z: -0.7, roll: 0, pitch: 0, yaw: 1.5}     metres and degrees

or a 4 x 4 matrix, {matrix: [[1, 0, 0, 0.5], ...]}. metadata.csv in each folder has one line per
scan: frame (its name), timestamp (in seconds). A radar point gets the label of the nearest LiDAR
point, or 255 (unknown) if none is near. A LiDAR scan without a radar frame is written alone.
"""

import argparse
import csv
from collections.abc import Sequence
from pathlib import Path

import numpy as np
from tqdm import tqdm

from derain.cards.card import load_card
from derain.cli.options import add_columns, factor, read_by
from derain.cli.outputs import folder_sink, print_lines
from derain.errors import InputError, counted
from derain.files import write_scan
from derain.files.atomic import replacing
from derain.files.extrinsics import read_extrinsics
from derain.files.frame_times import FRAME_COLUMNS, METADATA, read_frame_times
from derain.files.labels import LABEL, instance, read_labels, write_labels
from derain.fusion import LABEL_WITHIN, NO_DETECTIONS, fuse, nearest_in_time
from derain.scan import Floats
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.source import Source

LAYOUT = load_card("rehearse3d").layout


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--lidar", type=Path, required=True, help="folder of LiDAR scans")
    parser.add_argument("--radar", type=Path, required=True, help="folder of radar frames")
    parser.add_argument(
        "--extrinsics",
        type=Path,
        required=True,
        help="YAML file: radar's pose in the LiDAR's frame",
    )
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--within",
        type=factor,
        default=0.05,
        metavar="SECONDS",
        help="pair frames at most SECONDS apart (default: %(default)s)",
    )
    parser.add_argument("--labels", type=Path, help="folder of the LiDAR scans' labels")
    parser.add_argument(
        "--label-within",
        type=factor,
        default=LABEL_WITHIN,
        metavar="METRES",
        help="label radar points within METRES of a LiDAR point (default: %(default)s)",
    )
    parser.add_argument(
        "--extra",
        default="",
        metavar="COLUMNS",
        help="radar columns to keep, such as doppler,rcs; writes .npz files, whose column radar "
        "marks the radar points",
    )
    for sensor in ("lidar", "radar"):
        add_columns(parser, f"--{sensor}-columns", of=f"the {sensor}'s ")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    scans, labels = (arguments.out / name for name in (LAYOUT.scans, LAYOUT.labels))
    for folder in (arguments.lidar, arguments.radar, arguments.labels):
        if folder is not None and folder.resolve() in (scans.resolve(), labels.resolve()):
            raise InputError(arguments.out, f"would overwrite {folder}", "Give another --out.")
    extrinsics = read_extrinsics(arguments.extrinsics)
    lidar = named_frames([arguments.lidar], arguments.lidar_columns, layouts=())
    radar = named_frames([arguments.radar], arguments.radar_columns, layouts=())
    folder_sink(scans, lidar)
    extra = [name for name in arguments.extra.split(",") if name]
    for former in scans.glob("*.bin" if extra else "*.npz"):
        reason = "is of a run with another --extra, and would become a second scan of its name"
        raise InputError(former, reason, "Delete these scans, or give another --out.")
    times = _times(lidar)
    nearest = nearest_in_time(times, _times(radar), arguments.within)
    if (nearest < 0).all():
        reason = f"no frame is within {arguments.within:g} s of a LiDAR scan"
        remedy = "Check that the timestamps are seconds of one clock, or widen --within."
        raise InputError(arguments.radar, reason, remedy)
    partners = [radar[number] if number >= 0 else None for number in nearest.tolist()]
    suffix = ".npz" if extra else ".bin"
    for frame, partner in tqdm(zip(lidar, partners, strict=True), total=len(lidar), disable=None):
        scan, label, detections = read_by(frame, "--lidar-columns"), None, NO_DETECTIONS
        if partner is not None:
            detections = read_by(partner, "--radar-columns")
        if arguments.labels is not None:
            label = read_labels(arguments.labels / f"{frame.key}{LABEL}", len(scan))
            scan = scan.with_label(label)
        fused = fuse(scan, detections, extrinsics, arguments.label_within, extra)
        write_scan(scans / f"{frame.key}{suffix}", fused)
        if label is not None and fused.label is not None:
            instances = np.pad(instance(label), (0, len(detections)))  # the radar's are of none
            write_labels(labels / f"{frame.key}{LABEL}", fused.label, instances)
    _write_metadata(scans / METADATA, lidar, times, partners)
    alone = partners.count(None)
    print_lines(f"{counted(len(lidar), 'scan')} in {scans}, {alone} of them without a radar frame")
    return 0


def _times(frames: Source) -> Floats:
    """Times of the frames in seconds, from the metadata in their folders."""
    return read_frame_times([Path(frame.name) for frame in frames])


def _write_metadata(
    path: Path, frames: Source, times: Floats, partners: Sequence[Frame | None]
) -> None:
    """Writes when each scan was taken, and which radar frame is in it."""
    with replacing(path) as temporary, temporary.open("w", newline="", encoding="utf-8") as file:
        writer = csv.writer(file)
        writer.writerow([*FRAME_COLUMNS, "radar_frame"])
        for frame, time, partner in zip(frames, times.tolist(), partners, strict=True):
            writer.writerow([frame.key, time, partner.key if partner else ""])
