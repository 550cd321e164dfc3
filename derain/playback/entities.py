"""Where everything stands in a recording to look at, and what its points are classed as.

- ``sensor``: the pose, where poses are known. Below it, in the sensor's frame:
  ``sensor/scan/points`` (shades of intensity), ``sensor/scan/truth`` (what labels call rain, and of
  what they do not know), and for each method ``sensor/methods/<title>/kept``, ``.../removed``,
  ``.../missed`` (what labels call rain among what is kept, once more) and ``.../probability``.
- ``trajectory``: the way of the sensor.
- ``range_image/scan`` (range), and over it ``range_image/methods/<title>`` (what was found).
- ``share/scan/truth`` and ``share/methods/<title>``: per cent of the points that can be judged.
- ``iou/methods/<title>``: IoU with what labels call rain, of the points of which they know.
- ``caption``: the scan's name, and what the colours mean.
"""

from dataclasses import dataclass

import numpy as np
import rerun
from numpy.typing import NDArray

from derain.pictures import palette
from derain.pictures.palette import OUTCOMES, rgb

SENSOR = "/sensor"
SCAN = "/sensor/scan"
POINTS = "/sensor/scan/points"
TRAJECTORY = "/trajectory"
RANGE_IMAGE = "/range_image"
RANGES = "/range_image/scan"
SHARE = "/share"
IOU = "/iou"
CAPTION = "/caption"

# Timelines: the place of a scan in its recording, and seconds since the first one that is shown.
FRAME, TIME = "frame", "time"

# Classes of points. The first shows nothing, in images of classes; those of OUTCOMES follow.
NOTHING = 0
CLASS_KEPT = 1
CLASS_MISSED = 1 + list(OUTCOMES).index("rain, left")
CLASS_RAIN = len(OUTCOMES) + 1
CLASS_NOT_KNOWN = len(OUTCOMES) + 2


@dataclass(frozen=True)
class OfMethod:
    """Where what a method says stands.

    Attributes:
        title: What the method is called.
    """

    title: str

    @property
    def all(self) -> str:
        """All of its points."""
        return rerun.new_entity_path(["sensor", "methods", self.title])

    @property
    def kept(self) -> str:
        """The points that it leaves."""
        return f"{self.all}/kept"

    @property
    def removed(self) -> str:
        """The points that it calls rain."""
        return f"{self.all}/removed"

    @property
    def missed(self) -> str:
        """The points that it leaves, and that labels call rain."""
        return f"{self.all}/missed"

    @property
    def probability(self) -> str:
        """The points that may be rain, by the probability that it gives them."""
        return f"{self.all}/probability"

    @property
    def image(self) -> str:
        """What it finds, over the range image."""
        return rerun.new_entity_path(["range_image", "methods", self.title])

    @property
    def share(self) -> str:
        """Share of the points that it removes, per cent."""
        return rerun.new_entity_path(["share", "methods", self.title])

    @property
    def iou(self) -> str:
        """IoU with what labels call rain, of each scan."""
        return rerun.new_entity_path(["iou", "methods", self.title])


@dataclass(frozen=True)
class OfLabels:
    """Where what labels say stands.

    Attributes:
        name: What they are: ``truth``, or ``teacher``.
    """

    name: str

    @property
    def points(self) -> str:
        """The points that they call rain, and those of which they do not know."""
        return f"/sensor/scan/{self.name}"

    @property
    def share(self) -> str:
        """Share of rain in the points, per cent."""
        return f"/share/scan/{self.name}"

    @property
    def share_not_known(self) -> str:
        """Share of the points of which they do not know, per cent."""
        return f"/share/scan/{self.name}_not_known"


def classes() -> rerun.AnnotationContext:
    """Names and colours of the classes."""
    coloured = {**OUTCOMES, "rain": palette.RAIN, "not known": palette.MISSED}
    return rerun.AnnotationContext(
        [
            rerun.AnnotationInfo(NOTHING, "", (0, 0, 0, 0)),
            *(
                rerun.AnnotationInfo(number, name, rgb(colour))
                for number, (name, colour) in enumerate(coloured.items(), CLASS_KEPT)
            ),
        ]
    )


def class_of(outcome: NDArray[np.int64]) -> NDArray[np.uint16]:
    """Class of each point by what became of it, uint16 (N,).

    Args:
        outcome: Numbers of ``OUTCOMES``, int64 (N,).
    """
    return (outcome + CLASS_KEPT).astype(np.uint16)
