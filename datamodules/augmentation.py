"""What training changes about a scan before the network sees it."""

from dataclasses import dataclass, replace

import numpy as np

from derain.scan import Scan


@dataclass(frozen=True)
class Augmentation:
    """Random rotation about the sensor's vertical axis, mirroring, jitter, and dropped points.

    The published recipe jitters by 0.1 *after* normalisation, which is 2.6 m in x and 0.16 m in z
    on WADS, and leaves the neighbours' distances those of the still cloud. Here the jitter is in
    metres and comes before the view, so that coordinates and distances agree.

    Attributes:
        rotation_probability: Share of scans that are turned by an angle of 0 to 360 degrees.
        jitter_probability: Share of scans whose coordinates are jittered.
        jitter: Standard deviation of the jitter in metres, about a LiDAR's range noise.
        mirror_probability: Share of scans whose left and right change places.
        dropping_probability: Share of scans that lose points.
        dropping: The largest share of its points that such a scan loses.

    Source: sporsho/3D_OutDet, dataset/_point_cloud_dataset.py, for rotation, jitter and their 0.5;
        TiagoCortinhal/SalsaNext for mirroring and dropping.
    """

    rotation_probability: float = 0.5
    jitter_probability: float = 0.5
    jitter: float = 0.01
    mirror_probability: float = 0.0
    dropping_probability: float = 0.0
    dropping: float = 0.5

    def __call__(self, scan: Scan, rng: np.random.Generator) -> Scan:
        """Returns a changed copy; labels and intensities stay with their points, in their order."""
        valid = scan.valid  # no return is no return, wherever it is turned
        moved = scan.xyz[valid]
        if rng.random() < self.rotation_probability:
            angle = rng.uniform(0, 2 * np.pi)
            cosine, sine = np.cos(angle), np.sin(angle)
            rotation = np.array([[cosine, sine, 0], [-sine, cosine, 0], [0, 0, 1]], np.float32)
            moved = moved @ rotation
        if rng.random() < self.jitter_probability:
            moved = moved + rng.normal(0, self.jitter, moved.shape).astype(np.float32)
        if rng.random() < self.mirror_probability:
            moved = moved * np.array([1, -1, 1], np.float32)
        xyz = scan.xyz.copy()
        xyz[valid] = moved
        changed = replace(scan, xyz=xyz)
        if rng.random() < self.dropping_probability:
            return changed.take(rng.random(len(scan)) >= rng.uniform(0, self.dropping))
        return changed
