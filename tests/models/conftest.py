"""What the tests of models share."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

import lightning
import numpy as np
import pytest
import torch
from recorded_scenes import write_scenes
from torch import Tensor, nn

from derain.cards.card import load_card
from derain.datamodules.base import Loading
from derain.datamodules.folder import Folder
from derain.learning.batch import Sample
from derain.models.base import DerainingModule
from derain.models.outdet import OutDet
from derain.scan import Scan
from derain.spec import Spec


def randomise(network: nn.Module, seed: int) -> None:
    """Draws weights and BatchNorm statistics as a long training might leave them."""
    generator = torch.Generator().manual_seed(seed)
    with torch.no_grad():
        for name, tensor in network.state_dict().items():
            if name.endswith("running_var"):
                tensor.uniform_(0.5, 1.5, generator=generator)
            elif tensor.is_floating_point():
                fan_in = max(tensor[0].numel(), 1)
                tensor.normal_(0, fan_in**-0.5, generator=generator)


@pytest.fixture
def outdet() -> Callable[..., OutDet]:
    """Makes a 3D-OutDet in evaluation mode, of random weights, statistics and normalisation."""

    def make(
        seed: int = 0,
        neighbours: int = 9,
        channels: tuple[str, ...] = ("x", "y", "z", "intensity"),
    ) -> OutDet:
        rng = np.random.default_rng(seed)
        model = OutDet(neighbours=neighbours, channels=channels)
        randomise(model.network, seed)
        model.adopt(
            Spec(
                network="outdet",
                view=model.view_for([]).as_dict(),
                mean=tuple(rng.normal(0, 3, len(channels)).tolist()),
                std=tuple(rng.uniform(0.5, 20, len(channels)).tolist()),
                classes={0: "other", 1: "rain"},
                rain=(1,),
                data="random",
                licence="none",
                channels=model.channels,
                units=("not stated",) * len(channels),
            )
        )
        return model.eval()

    return make


@pytest.fixture
def image_network(small_grid) -> Callable[..., Any]:
    """Makes a small SalsaNext or LiSnowNet in evaluation mode, of random weights, as for WADS."""

    def make(model_class: type[DerainingModule], **arguments: Any) -> DerainingModule:
        model = model_class(**{"grid": small_grid, "width": 4, **arguments})
        randomise(model.network, seed=0)
        model.adopt(model.spec_for(load_card("wads")))
        return model.eval()

    return make


@pytest.fixture
def sample() -> Callable[..., Sample]:
    """Views a scan as a model does, with a random truth or one class for all."""

    def view(model: DerainingModule, points: Scan | np.ndarray, rain: float = 0.3) -> Sample:
        scan = Scan.of(points)
        truth = np.random.default_rng(len(scan)).random(len(scan)) < rain
        seen = model.spec.make_view()(scan)
        labelled = scan.with_label(np.where(truth, 110, 0))
        return Sample(labelled, seen, torch.from_numpy(seen.target(truth)))

    return view


@pytest.fixture(scope="module")
def make_trainer() -> Iterator[Callable[..., lightning.Trainer]]:
    """Makes a trainer that writes nothing, and adds its sums in the same order every time."""

    def make(epochs: int, **arguments: Any) -> lightning.Trainer:
        return lightning.Trainer(
            accelerator="cpu",
            deterministic=True,
            max_epochs=epochs,
            enable_progress_bar=False,
            enable_model_summary=False,
            **{"logger": False, "enable_checkpointing": False, **arguments},
        )

    yield make
    torch.use_deterministic_algorithms(False)


def assert_same(one: Mapping[str, Tensor], other: Mapping[str, Tensor]) -> None:
    """Asserts that two mappings hold the same tensors; what is undefined is so in both."""
    torch.testing.assert_close(dict(one), dict(other), rtol=0, atol=0, equal_nan=True)


@pytest.fixture
def scenes(tmp_path) -> Callable[..., Folder]:
    """Makes a data module of four small labelled scenes, three of which are trained on."""

    def make(card: str = "simulated", **loading: Any) -> Folder:
        write_scenes(tmp_path, *4 * [300], name="{}.bin", rain=load_card(card).rain[0])
        parts = {"train": ["[012].bin"], "validation": ["3.bin"], "test": ["3.bin"]}
        return Folder(str(tmp_path), card, **parts, loading=Loading(**loading))

    return make
