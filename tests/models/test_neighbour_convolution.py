"""The convolution over neighbourhoods is its formula, and so is its gradient, block by block."""

import pytest
import torch
from torch import Tensor

from derain.models.outdet import network
from derain.models.outdet.network import convolve

INPUTS, OUTPUTS, K, POINTS = 3, 4, 5, 11


@pytest.fixture(autouse=True)
def small_blocks(monkeypatch) -> None:
    monkeypatch.setattr(network, "POINT_BLOCK", 4)  # 11 points: two blocks and a part


def case(rows: int = POINTS) -> tuple[Tensor, Tensor, Tensor]:
    generator = torch.Generator().manual_seed(rows)
    features = torch.randn(POINTS, INPUTS, dtype=torch.double, generator=generator)
    neighbours = torch.randint(POINTS, (rows, K), generator=generator)
    weight = torch.randn(INPUTS, OUTPUTS, K, dtype=torch.double, generator=generator)
    return features, neighbours, weight


@pytest.mark.parametrize("rows", [0, 1, 4, 8, POINTS], ids=str)
def test_it_is_a_sum_over_neighbours_and_channels(rows) -> None:
    features, neighbours, weight = case(rows)
    expected = torch.einsum("pji,ioj->po", features[neighbours], weight)
    torch.testing.assert_close(convolve(features, neighbours, weight), expected)


@pytest.mark.parametrize("rows", [0, 3, POINTS], ids=str)
def test_its_gradient_is_that_of_the_sum(rows) -> None:
    features, neighbours, weight = case(rows)
    features.requires_grad_(), weight.requires_grad_()
    assert torch.autograd.gradcheck(lambda f, w: convolve(f, neighbours, w), (features, weight))


def test_points_that_need_no_gradient_get_none() -> None:
    features, neighbours, weight = case()
    convolve(features, neighbours, weight.requires_grad_()).sum().backward()
    assert features.grad is None
    assert weight.grad is not None


def test_a_gradient_inside_of_autocast_is_that_outside() -> None:
    features, neighbours, weight = (t.float() if t.is_floating_point() else t for t in case())
    features.requires_grad_(), weight.requires_grad_()
    with torch.autocast("cpu", torch.bfloat16):
        inside = torch.autograd.grad(
            convolve(features, neighbours, weight).sum(), [features, weight]
        )
    outside = torch.autograd.grad(convolve(features, neighbours, weight).sum(), [features, weight])
    for one, other in zip(inside, outside, strict=True):
        torch.testing.assert_close(one, other)
