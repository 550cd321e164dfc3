"""SalsaNext: a range image in, a class for every pixel out; here, rain or not."""

from derain.models.salsanext.module import DeployedSalsaNext, SalsaNext, SalsaNextModule
from derain.models.salsanext.network import SalsaNextNetwork

__all__ = ["DeployedSalsaNext", "SalsaNext", "SalsaNextModule", "SalsaNextNetwork"]
