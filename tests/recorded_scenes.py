"""Recordings of made-up scenes, as tests of every part of derain read some."""

from pathlib import Path

import numpy as np

from derain.evaluation.hard_cases import scene
from derain.files.labels import write_labels


def write_scenes(
    folder: Path, *sizes: int, name: str = "{:06d}.bin", rain: int | None = None
) -> Path:
    """Writes a scene of each number of points, which is drawn by its place, and returns the folder.

    Args:
        folder: A folder, which is made.
        sizes: Points of each scan.
        name: Name of a scan by its place.
        rain: Class of the drops, a tenth of the points; None writes no labels.
    """
    folder.mkdir(parents=True, exist_ok=True)
    for place, points in enumerate(sizes):
        path = folder / name.format(place)
        scene(points, seed=place).tofile(path)
        if rain is not None:
            drops = np.arange(points) >= points - points // 10
            write_labels(path.with_suffix(".label"), np.where(drops, rain, 0))
    return folder


def write_wads(root: Path, *sequences: str) -> Path:
    """Writes a labelled scan of 300 points for each sequence of a WADS, and returns its root."""
    for place, sequence in enumerate(sequences):
        scans, labels = (root / "sequences" / sequence / name for name in ("velodyne", "labels"))
        scans.mkdir(parents=True)
        scene(300, seed=place).tofile(scans / "0.bin")
        write_labels(labels / "0.label", np.where(np.arange(300) >= 270, 110, 0))
    return root


def write_drive(folder: Path, scans: int, points: int, seed: int) -> Path:
    """Writes scans of a drive past a scene, a tenth of their points drops, with their poses."""
    folder.mkdir(parents=True)
    drops, poses = points // 10, []
    for number in range(scans):
        seen = scene(points, seed=seed)
        seen[:, 0] -= 0.3 * number
        seen[:drops, :3] = np.random.default_rng(number).uniform(-6, 6, (drops, 3))
        seen.tofile(folder / f"{number:06d}.bin")
        poses.append(f"1 0 0 {0.3 * number} 0 1 0 0 0 0 1 0")
    (folder / "poses.txt").write_text("\n".join(poses))
    return folder
