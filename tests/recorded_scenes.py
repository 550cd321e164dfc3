"""A recording of made-up scenes, as tests of every part of derain read some."""

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
