"""What a point of the simulated track can be."""

from enum import IntEnum


class TrackClass(IntEnum):
    """Semantic class ids of REHEARSE-3D.

    Source: data_cfg.yaml of the SalsaNext model published with REHEARSE-3D.
    """

    BACKGROUND = 0
    CAR = 1
    SPRINKLER = 2
    RAIN = 3
    PEDESTRIAN = 4
    BIKE = 5
    TARGET = 6
    ROAD = 7
