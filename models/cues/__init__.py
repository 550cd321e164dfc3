"""Several cues, each in log-odds, and one fusion that weighs them."""

from derain.models.cues.module import CuedOutDet
from derain.models.cues.network import CuedNetwork

__all__ = ["CuedNetwork", "CuedOutDet"]
