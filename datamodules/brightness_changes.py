"""Other intensities for a scan: on another sensor, brightness means something else."""

from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from derain.scan import Scan

# How often rain alone is made brighter or darker, by up to e to this power; and how often that is
# then cut to whole numbers, of up to so few.
# Source: modelling choices, as are the rest.
OF_RAIN, STRONGEST, WHOLE = 0.45, 4.0, 0.4
COARSEST = (-2.5, 0.5)

# Levels that intensities are cut to, where they are.
FEW_LEVELS = 7


def with_other_brightness(
    scan: Scan, rain: NDArray[np.bool_], generator: np.random.Generator
) -> Scan:
    """A scan whose intensities are made all alike, inverted, cut to a few levels, or other in rain.

    Args:
        scan: The scan; one without intensities stays as it is.
        rain: Its rain, bool (N,).
        generator: Draws the change.
    """
    if scan.intensity is None or not scan.valid.any():
        return scan
    valid, known = scan.valid, scan.intensity[scan.valid]
    if rain.any() and generator.random() < OF_RAIN:
        changed = _with_other_rain(known, rain[valid], generator)
    else:
        changed = _of_all(known, generator)
    intensity = scan.intensity.copy()  # rows without a return stay as they are
    intensity[valid] = changed
    return replace(scan, intensity=intensity)


def _of_all(known: NDArray[np.float32], generator: np.random.Generator) -> NDArray[np.float32]:
    match generator.integers(3):
        case 0:
            return np.zeros_like(known)
        case 1:
            inverted: NDArray[np.float32] = known.max() - known
            return inverted
        case _:
            levels = np.sort(generator.choice(known, FEW_LEVELS - 1))
            return np.searchsorted(levels, known).astype(np.float32)


def _with_other_rain(
    intensity: NDArray[np.float32], rain: NDArray[np.bool_], generator: np.random.Generator
) -> NDArray[np.float32]:
    largest = intensity.max()
    factor = np.exp(generator.uniform(-STRONGEST, STRONGEST))
    result = np.where(rain, np.minimum(intensity * factor, largest), intensity)
    if generator.random() < WHOLE:
        result = np.floor(result * np.exp(generator.uniform(*COARSEST)))
    return result.astype(np.float32)
