"""Simulated rain on a test track, made on the user's machine."""

from pathlib import Path

from derain.datamodules.base import Loading
from derain.datamodules.sequences import Sequences
from derain.errors import InputError
from derain.jobs.workers import processes
from derain.simulation.campaign import Campaign
from derain.simulation.dataset import simulate_track
from derain.simulation.manifest import read_manifest
from derain.simulation.world import WorldCampaign
from derain.system.cores import usable_cores


class SimulatedDataModule(Sequences):
    """A simulated data set, made where it is missing.

    Args:
        root: Folder of the data set.
        campaign: The simulation, run where the folder does not hold its result.
        make: True to run it; False takes any simulated data set in the folder.
        loading: Options for reading and batching scans.
        workers: Processes that simulate; 0 takes one per core.

    Raises:
        InputError: No simulated data set in the folder, where none is made.
    """

    def __init__(
        self,
        root: str,
        campaign: Campaign | WorldCampaign,
        make: bool,
        loading: Loading,
        workers: int = 1,
    ) -> None:
        split = campaign.split
        if not make:
            manifest = read_manifest(Path(root))
            if not {"files", "split"} <= manifest.keys():
                raise InputError(
                    root,
                    "holds no complete simulated data set",
                    "Make it with `derain simulate --out`.",
                )
            split = manifest["split"]
        super().__init__(root, "simulated", split, loading)
        self.campaign = campaign
        self.make = make
        self.workers = workers or usable_cores()

    def prepare_data(self) -> None:
        """Simulates the data set where it is missing.

        Raises:
            InputError: A folder that holds something else or cannot be written.
        """
        if self.make:
            with processes(self.workers) as executor:
                simulate_track(self.root, self.campaign, executor)


class Simulated(SimulatedDataModule):
    """A simulated data set in the layout of REHEARSE-3D: by default a small one, made at first use.

    Simulated rain is easy to find: scores on it are no evidence of quality on real rain.

    Example:
        >>> data = Simulated("rain")  # nothing is simulated before training needs it
        >>> data.split["validation"]
        ['016', '017', '018', '019']

    Args:
        root: Folder of the data set.
        campaign: The simulation, run where the folder does not hold its result.
        make: True to run it; False takes any data set that ``derain simulate`` wrote there.
        loading: Options for reading and batching scans.

    Raises:
        InputError: No simulated data set in the folder, where none is made.
    """

    def __init__(
        self,
        root: str = "runs/simulated",
        campaign: Campaign = Campaign(),
        make: bool = True,
        loading: Loading = Loading(),
    ) -> None:
        super().__init__(root, campaign, make, loading)
