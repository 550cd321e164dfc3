"""3D-OutDet made relative: neighbours seen in steps of the sensor's beams."""

from derain.models.relative_outdet.module import RelativeOutDet
from derain.models.relative_outdet.network import RelativeOutDetNetwork

__all__ = ["RelativeOutDet", "RelativeOutDetNetwork"]
