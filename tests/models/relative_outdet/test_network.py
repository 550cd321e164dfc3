"""What a point is told of its whole scan."""

import numpy as np
import pytest
import torch
from torch import Tensor

from derain.models.relative_outdet import RelativeOutDetNetwork
from derain.views.neighbour_search import NeighbourSearch

from .beams import sphere


def logits(network: RelativeOutDetNetwork, xyz: np.ndarray) -> Tensor:
    neighbours, distances = NeighbourSearch(xyz, threads=1)(9)
    with torch.no_grad():
        scores: Tensor = network(*map(torch.from_numpy, (xyz, distances, neighbours)))
    return scores[:, 1]


@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize("context", [0, 16])
def test_the_rest_of_a_scan_matters_by_its_context_alone(seed: int, context: int) -> None:
    """What is four times as far off is no one's neighbour, and on beams of the same step."""
    torch.manual_seed(seed)
    network = RelativeOutDetNetwork(context=context).eval()
    here, there = (sphere(20, 40, 0.01, distance) for distance in (12.0, 48.0))
    alone = logits(network, here)
    among = logits(network, np.concatenate([here, there]))[: len(here)]
    if context:
        assert (alone - among).abs().min() > 1e-4  # of every point
    else:
        torch.testing.assert_close(alone, among)
