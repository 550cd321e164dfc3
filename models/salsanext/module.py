"""SalsaNext: a range image in, a class for every pixel out; here, rain or not.

Source: T. Cortinhal, G. Tzelepis, E. E. Aksoy, "SalsaNext: Fast, Uncertainty-aware Semantic
Segmentation of LiDAR Point Clouds for Autonomous Driving", ISVC 2020; TiagoCortinhal/SalsaNext
(MIT).
"""

from collections.abc import Mapping
from typing import Self

from torch import Tensor

from derain.cards.card import DataCard
from derain.errors import InputError
from derain.models.published import Published
from derain.models.range_module import require_grid
from derain.models.registry import NETWORKS
from derain.models.salsanext.network import SalsaNextNetwork
from derain.models.salsanext.training import SalsaNextModule


@NETWORKS.add("salsanext")
class SalsaNext(SalsaNextModule, Published):
    """SalsaNext as published, trained on rain.

    Example:
        >>> model = SalsaNext(grid="rehearse3d", width=8)
        >>> model.network.width, model.channels
        (8, ('range', 'x', 'y', 'z', 'intensity'))
    """

    network: SalsaNextNetwork

    def network_for(self, channels: int, width: int, dropout: float) -> SalsaNextNetwork:
        """The network as published; a width of 32 is the published one."""
        return SalsaNextNetwork(channels, width, dropout=dropout)

    @classmethod
    def from_published(
        cls, state_dict: Mapping[str, Tensor], card: DataCard, grid: str | None = None
    ) -> Self:
        """Builds the model from a published state_dict, with or without ``module.`` prefixes.

        Raises:
            InputError: A state_dict of another network or of more than two classes, or no grid.
        """
        network = SalsaNextNetwork.from_published(state_dict)
        if (network.channels, network.classes) != (len(cls.CHANNELS), 2):
            raise InputError(
                cls.NAME,
                f"the weights tell {network.classes} classes from {network.channels} channels",
                f"Give weights that tell rain from the rest, from {', '.join(cls.CHANNELS)}.",
            )
        model = cls(grid=require_grid(grid, cls.NAME), width=network.width)
        model.network = network
        model.adopt(model.spec_for(card))
        return model
