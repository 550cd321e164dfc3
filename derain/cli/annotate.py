"""Labels the scans of one sequence as REHEARSE-3D is labelled, by the geometry of its scene.

It fits a plane to the road. Points in a box get the class of the box; other points over the road
are rain or road, by their height above the plane; everything else is background. It writes
<stem>.label with the class ids of REHEARSE-3D (255: unknown), and a picture of the sequence.

  derain annotate sequences/003 --scene scene.yaml --out labels/003
  derain annotate scans/*.bin --scene scene.yaml --out labels --sequence 003
  derain annotate lidar --scene scene.yaml --out labels --radar radar --within 0.5

A scene file, in metres and degrees in the sensor's frame (x forward, y left, z up):

  road: [[2, -4], [60, -4], [60, 4], [2, 4]]      # corners x, y in order
  boxes:               # size: length along the heading, width, height
    car_1: {class: car, centre: [20, 1, -0.6], size: [4.5, 1.8, 1.5], heading: 5}
    mast_1: {class: sprinkler, centre: [8, 4.5, 0.7], size: [0.3, 0.3, 4]}
  height: 0.1          # rain begins at this height above the road
  rain_area: [[2, -9], [60, -9], [60, 9], [2, 9]] # area of the rain (default: the road)
  corrections:         # shift, size or heading that differ in a sequence
    "003": {boxes: {car_1: {shift: [0.2, 0, 0]}}}

The classes are background, car, sprinkler, rain, pedestrian, bike, target and road. Only the road
is required: begin with the road alone, then add boxes around objects that the picture shows as
rain.

Each radar frame, in the LiDAR's frame, belongs to the scan of the same name. Its points get the
label of the nearest LiDAR point, in the folder radar. For other radar frames leave --radar out, and
give the labels to `derain fuse --labels`, which pairs frames by time, transforms and labels them.
"""

import argparse
import os
from collections import Counter
from collections.abc import Sequence
from pathlib import Path

from tqdm import tqdm

from derain.cards.known import lidar_folders
from derain.cli.options import add_columns, factor, read_by
from derain.cli.outputs import folder_sink, print_lines
from derain.errors import InputError, counted
from derain.fusion import LABEL_WITHIN, transfer_labels
from derain.sources.folders import named_frames
from derain.sources.frame import Frame
from derain.sources.sink import FolderSink
from derain.sources.source import Source
from derain.sources.spread import evenly_spaced
from derain.system.extras import MATPLOTLIB, OPEN3D, require


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument(
        "scans", nargs="+", type=Path, help="scans, folders of scans, or a sequence's folder"
    )
    parser.add_argument("--scene", type=Path, required=True, help="scene file")
    parser.add_argument("--out", type=Path, required=True, help="folder to write to")
    parser.add_argument(
        "--sequence", help="name of the sequence, for its corrections (default: name of the folder)"
    )
    parser.add_argument("--radar", type=Path, help="also label the radar frames in this folder")
    parser.add_argument(
        "--within",
        type=factor,
        default=LABEL_WITHIN,
        metavar="METRES",
        help="label radar points within METRES of a LiDAR point (default: %(default)s)",
    )
    for option in ("--columns", "--radar-columns"):
        add_columns(parser, option)


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("annotate", OPEN3D, MATPLOTLIB)
    from derain.annotation.picture import annotation_figure
    from derain.annotation.scene import read_scene
    from derain.annotation.steps import CLASS_NAMES, SCANS_OF_A_PLANE, annotate, road_plane
    from derain.pictures.scan_pictures import save

    folders = [
        next((path / name for name in lidar_folders() if os.path.isdir(path / name)), path)
        for path in arguments.scans
    ]
    source = named_frames(folders, arguments.columns, layouts=())  # one sequence, no data set
    folder = Path(source[0].name).absolute().parent
    if folder.name in lidar_folders():  # of a sequence
        folder = folder.parent
    sequence = arguments.sequence or folder.name
    sink = folder_sink(arguments.out, source)
    radar = _radar_frames(arguments.radar, arguments.radar_columns, source)
    radar_sink = FolderSink(sink.folder / "radar")
    scene = read_scene(arguments.scene).in_sequence(sequence)
    plane = road_plane([frame.read() for frame in evenly_spaced(source, SCANS_OF_A_PLANE)], scene)

    points: Counter[int] = Counter()
    for frame in tqdm(source, unit="scan", disable=None):
        scan = frame.read()
        label = annotate(scan, scene, plane)
        sink.write(frame, None, label)
        points.update(label.tolist())
        if frame.key in radar:
            detections = read_by(radar[frame.key], "--radar-columns")
            labelled = scan.with_label(label)
            transferred = transfer_labels(labelled, detections.xyz, arguments.within)
            radar_sink.write(radar[frame.key], None, transferred)
    picture = arguments.out / f"{sequence}.png"
    scan = source[len(source) // 2].read()
    title = f"sequence {sequence}, {Path(scan.name).name}: {len(scan):,} points"
    save(annotation_figure(scan, annotate(scan, scene, plane), scene, title), picture)
    lines = [
        f"sequence {sequence}: {counted(len(source), 'scan')}, {points.total():,} points",
        f"road: {plane.offset:.3f} m under the sensor, inclined by {plane.slope:.2f} degrees",
    ]
    for id_, name in CLASS_NAMES.items():
        share = points[id_] / max(points.total(), 1)
        lines.append(f"  {name:<11}{points[id_]:>14,} {share:>8.2%}")
    print_lines("\n".join([*lines, str(picture)]))
    return 0


def _radar_frames(folder: Path | None, columns: Sequence[str], source: Source) -> dict[str, Frame]:
    """Radar frames by the key of the scan that each belongs to."""
    if folder is None:
        return {}
    frames = {frame.key: frame for frame in named_frames([folder], columns, layouts=())}
    for key in frames.keys() - {frame.key for frame in source}:
        remedy = "Leave --radar out, and give the labels to `derain fuse --labels`."
        raise InputError(frames[key].name, "no scan has its name", remedy)
    return frames
