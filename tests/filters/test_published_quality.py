"""What the filters reach on the WADS sample, where others have measured the same definitions."""

import numpy as np
import pytest

from derain.filters import DROR, DSOR, ROR, SOR, SSR, FilterDerainer
from derain.scan import Bools, Scan

PUBLISHED = [
    (DROR(azimuth_resolution=0.04), 0.251),
    (DROR(), 0.658),
    (DROR(azimuth_resolution=0.32, variant="paper"), 0.658),  # twice the angle for the factor 2
    (DROR(azimuth_resolution=0.4), 0.154),
    (DSOR(range_multiplier=0.03), 0.310),
    (DSOR(), 0.626),
    (DSOR(range_multiplier=0.08), 0.723),
    (SOR(neighbours=5, deviation_multiplier=0.01), 0.138),
    (ROR(neighbours=4, radius=0.08), 0.159),
    (SSR(), 0.781),
    (SSR(threshold=5), 0.774),
    (SSR(threshold=7.5), 0.757),
]


@pytest.fixture(scope="module")
def snowfall(shared) -> tuple[Scan, Bools]:
    """The scan, and which of its points are falling snow."""
    points = np.fromfile(shared / "data/wads/sample.bin", np.float32).reshape(-1, 4)
    label = np.fromfile(shared / "data/wads/sample.label", np.uint32) & 0xFFFF
    return Scan.of(points), label == 110


@pytest.mark.parametrize(("filter_", "iou"), PUBLISHED, ids=str)
def test_a_filter_reaches_its_published_quality(snowfall, filter_, iou) -> None:
    scan, snow = snowfall
    found = FilterDerainer(filter_)(scan)
    assert (found & snow).sum() / (found | snow).sum() == pytest.approx(iou, abs=0.001)
