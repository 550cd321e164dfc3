"""SalsaNext: a range image in, a class for every pixel out; here, rain or not."""

from derain.models.salsanext.module import SalsaNext
from derain.models.salsanext.network import SalsaNextNetwork
from derain.models.salsanext.training import DeployedSalsaNext, SalsaNextModule

__all__ = ["DeployedSalsaNext", "SalsaNext", "SalsaNextModule", "SalsaNextNetwork"]
