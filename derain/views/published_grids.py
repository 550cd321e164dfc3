"""Grids that published networks and data sets use, described as a user describes one."""

from collections.abc import Mapping
from typing import Any

# Inclinations of WADS's 64 beams, degrees. LiSnowNet's own table is in its repository, which derain
# does not draw on. Source: measured here, on the ten raw scans of sequence 36, by
# `python benchmarks/back_projection.py --beams WADS/sequences/36/velodyne/*.bin`; the published
# sample scan gives the same, and the returns of a beam differ by no more than 0.00001 degrees.
WADS_BEAMS = [
    *(14.842, 10.992, 8.019, 5.017, 3.0, 1.988, 1.82, 1.648, 1.482, 1.311, 1.144, 0.973, 0.806),
    *(0.635, 0.468, 0.297, 0.129, -0.04, -0.209, -0.377, -0.548, -0.715, -0.885, -1.053, -1.224),
    *(-1.391, -1.562, -1.728, -1.9, -2.068, -2.238, -2.405, -2.576, -2.74, -2.913, -3.08, -3.25),
    *(-3.415, -3.588, -3.752, -3.924, -4.09, -4.261, -4.425, -4.598, -4.76, -4.932, -5.097),
    *(-5.269, -5.431, -5.605, -5.766, -5.938, -6.101, -7.103, -8.099, -9.1, -10.085, -11.072),
    *(-12.046, -13.014, -13.97, -18.929, -24.937),
]

PUBLISHED_GRIDS: Mapping[str, Mapping[str, Any]] = {
    # Source: Cortinhal et al. 2020, SalsaNext; its data_cfg and arch_cfg for SemanticKITTI.
    "semantickitti": {"rows": 64, "columns": 2048, "inclination": [-25.0, 3.0]},
    # Source: SalsaNext as run for REHEARSE-3D, arch_cfg.yaml (sporsho/sporsho.github.io).
    "rehearse3d": {"rows": 64, "columns": 2048, "inclination": [-20.0, 15.0]},
    # Source: Yu et al. 2022, LiSnowNet: one row a beam, 2048 columns.
    "wads": {"beams": WADS_BEAMS, "columns": 2048},
}
