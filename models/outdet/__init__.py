"""3D-OutDet: two convolutions over each point's nearest neighbours."""

from derain.models.outdet.module import OutDet
from derain.models.outdet.network import PUBLISHED_KEYS, FoldedOutDet, OutDetNetwork

__all__ = ["PUBLISHED_KEYS", "FoldedOutDet", "OutDet", "OutDetNetwork"]
