"""Paths of the entities in a recording, and the classes of its points.

- ``/sensor``: the sensor's pose, where poses are known. Below it, in the sensor's frame:
  ``/sensor/scan/points`` (shades of intensity), ``/sensor/scan/truth`` (labelled rain, and points
  whose label is unknown), and for each method ``/sensor/methods/<title>/kept``, ``.../removed``,
  ``.../missed`` (labelled rain that the method keeps) and ``.../probability``.
- ``/trajectory``: the sensor's path.
- ``/range_image/scan``: ranges, and over them ``/range_image/methods/<title>``: classes.
- ``/share/scan/truth`` and ``/share/methods/<title>``: per cent of the valid points.
- ``/iou/methods/<title>``: IoU with the labelled rain, over the points whose label is known.
- ``/caption``: the scan's name, and what the colours mean.
"""

import rerun

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

# Timelines: the number of a scan in its recording, and seconds since the first scan shown.
FRAME, TIME = "frame", "time"

# Classes of points. The first is transparent, in images of classes; those of OUTCOMES follow.
NOTHING = 0
CLASS_KEPT = 1
CLASS_MISSED = 1 + list(OUTCOMES).index("rain, left")
CLASS_RAIN = len(OUTCOMES) + 1
CLASS_NOT_KNOWN = len(OUTCOMES) + 2


class MethodEntities:
    """Paths of what a method finds.

    Args:
        title: Title of the method.

    Attributes:
        all: Parent of its points.
        kept: Points that it keeps.
        removed: Points that it calls rain.
        missed: Points that it keeps and that are labelled as rain.
        probability: Points that may be rain, shaded by their probability.
        image: Its result over the range image.
        share: Share of the points that it removes, per cent.
        iou: IoU with the labelled rain of each scan.
    """

    def __init__(self, title: str) -> None:
        below_methods = "methods" + rerun.new_entity_path([title])  # escapes the title
        self.all = f"{SENSOR}/{below_methods}"
        self.kept = f"{self.all}/kept"
        self.removed = f"{self.all}/removed"
        self.missed = f"{self.all}/missed"
        self.probability = f"{self.all}/probability"
        self.image = f"{RANGE_IMAGE}/{below_methods}"
        self.share = f"{SHARE}/{below_methods}"
        self.iou = f"{IOU}/{below_methods}"


def classes() -> rerun.AnnotationContext:
    """Names and colours of the classes."""
    coloured = {**OUTCOMES, "rain": palette.RAIN, "not known": palette.MISSED}
    named = [
        rerun.AnnotationInfo(number, name, rgb(colour))
        for number, (name, colour) in enumerate(coloured.items(), CLASS_KEPT)
    ]
    return rerun.AnnotationContext([rerun.AnnotationInfo(NOTHING, "", (0, 0, 0, 0)), *named])
