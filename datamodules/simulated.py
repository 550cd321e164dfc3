"""Simulated rain on a test track, made on the user's machine."""

from derain.cards import load_card
from derain.datamodules.base import Loading
from derain.datamodules.sequences import Layout, SequenceDataModule
from derain.simulation.dataset import Campaign, ensure_track


class Simulated(SequenceDataModule):
    """A small simulated data set in the layout of REHEARSE-3D; made at first use.

    Simulated rain is easy: a score on it says nothing about real rain.

    Args:
        root: Folder of the data set, made if it does not hold this campaign already.
        campaign: What is simulated.
        loading: How the scans are read and batched.
    """

    def __init__(
        self,
        root: str = "runs/simulated",
        campaign: Campaign = Campaign(),
        loading: Loading = Loading(),
    ) -> None:
        layout = Layout(scans="lidar_radar_pcd", labels="lidar_radar_labels")
        super().__init__(root, load_card("simulated"), layout, campaign.split, loading)
        self.campaign = campaign

    def prepare_data(self) -> None:
        """Simulates the data set where it is missing.

        Raises:
            InputError: A folder that holds something else or cannot be written.
        """
        ensure_track(self.root, self.campaign)
