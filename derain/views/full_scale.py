"""The full scale of intensities, which shows their unit."""

from collections.abc import Sequence

import numpy as np

from derain.scan import Scan

# Usual full scales of intensities in files: a share, one byte, two bytes.
FULL_SCALES = (1.0, 255.0, 65_535.0)


def full_scale(scans: Sequence[Scan]) -> float:
    """Full scale of the scans' intensities, in their unit; NaN if no scan has one that is a number.

    It is the smallest of FULL_SCALES that no intensity exceeds.

    Args:
        scans: Scans of one sensor.
    """
    intensities = [
        intensity[scan.valid & np.isfinite(intensity)]
        for scan in scans
        if (intensity := scan.intensity) is not None
    ]
    if not any(len(intensity) for intensity in intensities):
        return np.nan
    brightest = max(float(intensity.max(initial=0)) for intensity in intensities)
    return next((scale for scale in FULL_SCALES if brightest <= scale), FULL_SCALES[-1])
