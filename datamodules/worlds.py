"""Scans of many simulated worlds."""

from derain.datamodules.base import Loading
from derain.datamodules.simulated import SimulatedDataModule
from derain.simulation.world import WorldCampaign


class Worlds(SimulatedDataModule):
    """Scans each of another place, sensor and weather, made at first use.

    They train models for sensors and places that are not in any training data.

    Example:
        >>> data = Worlds("worlds")  # nothing is simulated before training needs it
        >>> len(data.split["train"]), data.split["validation"][0]
        (1000, '01000')

    Args:
        root: Folder of the data set.
        campaign: The simulation, run where the folder does not hold its result.
        make: True to run it; False takes what ``derain simulate --world`` wrote there.
        workers: Processes that simulate; 0 takes one per core.
        loading: Options for reading and batching scans.

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
