"""Several cues, each in log-odds, and one fusion that weighs them."""

from derain.models.cues.module import CueFusion
from derain.models.cues.network import CueNetwork

__all__ = ["CueFusion", "CueNetwork"]
