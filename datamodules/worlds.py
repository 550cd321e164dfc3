"""Scans of many simulated worlds, made on the user's machine."""

from derain.datamodules.base import Loading
from derain.datamodules.simulated import SimulatedDataModule
from derain.simulation.world_campaign import WorldCampaign


class Worlds(SimulatedDataModule):
    """Scans of which each is of another place, sensor and weather, made at first use.

    What learns from them is to work on sensors and in places that nobody has shown it.

    Example:
        >>> data = Worlds("worlds")  # nothing is simulated before training asks for it
        >>> len(data.split["train"]), data.split["validation"][0]
        (1000, '01000')

    Args:
        root: Folder of the data set.
        campaign: What is simulated where the folder does not hold it already.
        make: Whether it is simulated there; else what ``derain simulate --world`` wrote to the
            folder is taken, whatever the campaign.
        workers: Processes that simulate; 0 takes one per core.
        loading: How the scans are read and batched.

    Raises:
        InputError: Nothing is to be made, and there is no simulated data set in the folder.
    """

    def __init__(
        self,
        root: str = "runs/worlds",
        campaign: WorldCampaign = WorldCampaign(world="world"),
        make: bool = True,
        workers: int = 0,
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(root, campaign, make, loading, workers)
