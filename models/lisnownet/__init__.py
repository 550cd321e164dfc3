"""LiSnowNet: learns without a label what a range image would be without snow or rain."""

from derain.models.lisnownet.module import DeployedLiSnowNet, LiSnowNet
from derain.models.lisnownet.network import LiSnowNetwork

__all__ = ["DeployedLiSnowNet", "LiSnowNet", "LiSnowNetwork"]
