"""The classes of the points of a simulated track."""

from enum import IntEnum

from derain.scan import Ints


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


def packed(kind: Ints, thing: Ints | int) -> Ints:
    """Classes with the number of the moving thing in the upper 16 bits, int64 (N,).

    Args:
        kind: TrackClass, int64 (N,).
        thing: Number from 1 on, of each, int64 (N,), or of all; 0 does not move.
    """
    return kind | thing << 16


def unpacked(label: Ints) -> tuple[Ints, Ints]:
    """Classes and numbers, int64 (N,) each, of labels from :func:`packed`."""
    return label & 0xFFFF, label >> 16
