"""What the tests of all formats share."""

import numpy as np
import pytest

from derain import Scan


@pytest.fixture
def scan() -> Scan:
    """Five points with columns of many types."""
    generator = np.random.default_rng(0)
    columns = {
        "x": generator.normal(0, 20, 5).astype(np.float32),
        "y": generator.normal(0, 20, 5).astype(np.float32),
        "z": generator.normal(0, 2, 5).astype(np.float32),
        "intensity": np.array([0, 1, 17, 254, 255], np.uint8),
        "ring": np.array([0, 63, 64, 127, 65535], np.uint16),
        "offset": np.array([-(2**31), -1, 0, 1, 2**31 - 1], np.int32),
        "time": np.array([0.0, 1e-9, 0.1, 1 / 3, 1.7e9 + 1e-6]),
    }
    xyz = np.stack([columns[axis] for axis in "xyz"], axis=1)
    return Scan(xyz, columns["intensity"].astype(np.float32), fields=columns)
