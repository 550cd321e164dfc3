"""Paths of the entities in a recording, and the classes of its points.

- ``/sensor``: the sensor's pose, where poses are known. Below it, in the sensor's frame:
  ``/sensor/scan/points`` (shades of intensity), ``/sensor/scan/truth`` (labelled rain, and points
  whose label is unknown), and for each method ``/sensor/methods/<title>/kept``, ``.../removed`` and
  ``.../probability``.
- ``/ranges``: the range image of the scan.
- ``/share/scan/truth`` and ``/share/methods/<title>``: per cent of the valid points.
- ``/caption``: the scan's name, and what the colours mean.
"""

import rerun

from derain.pictures import palette
from derain.pictures.palette import OUTCOMES, rgb

SENSOR = "/sensor"
SCAN = "/sensor/scan"
POINTS = "/sensor/scan/points"
RANGES = "/ranges"
SHARE = "/share"
CAPTION = "/caption"

# Timelines: the number of a scan in its recording, and seconds since the first scan shown.
FRAME, TIME = "frame", "time"

# Classes of points: first the outcomes, by their numbers.
CLASS_RAIN = len(OUTCOMES)
CLASS_NOT_KNOWN = len(OUTCOMES) + 1


class MethodEntities:
    """Paths of what a method finds.

    Args:
        title: Title of the method.

    Attributes:
        all: Parent of its points.
        kept: Points that it keeps.
        removed: Points that it calls rain.
        probability: Points that may be rain, shaded by their probability.
        share: Share of the points that it removes, per cent.
    """

    def __init__(self, title: str) -> None:
        below_methods = "methods" + rerun.new_entity_path([title])  # escapes the title
        self.all = f"{SENSOR}/{below_methods}"
        self.kept = f"{self.all}/kept"
        self.removed = f"{self.all}/removed"
        self.probability = f"{self.all}/probability"
        self.share = f"{SHARE}/{below_methods}"


def classes() -> rerun.AnnotationContext:
    """Names and colours of the classes."""
    coloured = {**OUTCOMES, "rain": palette.RAIN, "not known": palette.MISSED}
    return rerun.AnnotationContext(
        [
            rerun.AnnotationInfo(number, name, rgb(colour))
            for number, (name, colour) in enumerate(coloured.items())
        ]
    )
