"""What SalsaNext and its variant have in common: images of any size, gradients, dropout."""

from collections import Counter

import pytest
import torch
from torch import Tensor, nn
from torch.nn.functional import cross_entropy

from derain.models.salsanext.network import SalsaNextNetwork, SalsaNextPlan
from derain.models.salsanext_lite import SalsaNextLiteNetwork

from ..conftest import randomise

both = pytest.mark.parametrize("kind", [SalsaNextNetwork, SalsaNextLiteNetwork])


def small(kind: type[SalsaNextPlan], width: int = 4) -> SalsaNextPlan:
    """A network with weights and statistics that leave no BatchNorm without effect."""
    network = kind(channels=5, width=width)
    randomise(network, seed=0)
    return network.eval()


def image(height: int, width: int, scans: int = 1) -> Tensor:
    generator = torch.Generator().manual_seed(height * 1000 + width)
    return torch.randn(scans, 5, height, width, generator=generator)


def step(network: nn.Module, batch: Tensor) -> None:
    """Computes the gradients of a training step, all of which are finite."""
    loss = cross_entropy(network.train()(batch), (batch[:, 0] > 0).long())
    loss.backward()
    assert loss.isfinite()
    for name, parameter in network.named_parameters():
        assert parameter.grad is not None
        assert parameter.grad.isfinite().all(), name


@both
@pytest.mark.parametrize(("height", "width"), [(1, 1), (2, 17), (15, 16), (20, 37), (32, 48)])
@torch.no_grad()
def test_an_image_of_any_size_counts_as_continued_by_empty_pixels(
    kind: type[SalsaNextPlan], height: int, width: int
) -> None:
    network, seen = small(kind), image(height, width)
    padded = torch.zeros(1, 5, -(-height // 16) * 16, -(-width // 16) * 16)
    padded[..., :height, :width] = seen
    logits = network(seen)
    assert logits.shape == (1, 2, height, width)
    torch.testing.assert_close(logits, network(padded)[..., :height, :width], rtol=0, atol=0)


@both
@pytest.mark.parametrize(
    ("scans", "height", "width"), [(1, 1, 1), (1, 16, 16), (2, 16, 16), (1, 20, 37)]
)
def test_a_training_step_on_small_images_is_finite(
    kind: type[SalsaNextPlan], scans: int, height: int, width: int
) -> None:
    step(small(kind), image(height, width, scans))


@both
def test_the_gradient_reaches_every_parameter(kind: type[SalsaNextPlan]) -> None:
    network = small(kind, width=8)
    # At the bottleneck 3×3 pixels: in fewer, some taps of its kernels only ever see the padding.
    step(network, image(48, 48, scans=2))
    assert all(parameter.grad.any() for parameter in network.parameters())


@pytest.mark.parametrize(
    ("kind", "drops"),
    # On the way down; on the way up before and after the layers, and, in SalsaNext, the joint.
    [(SalsaNextNetwork, 4), (SalsaNextLiteNetwork, 3)],
)
def test_features_are_dropped_everywhere_but_at_full_resolution(
    kind: type[SalsaNextPlan], drops: int
) -> None:
    network = kind(width=4, dropout=0.3).train()
    dropped: list[tuple[int, float]] = []

    def record(layer: nn.Dropout2d, inputs: tuple[Tensor], _: Tensor) -> None:
        dropped.append((inputs[0].shape[-1], layer.p))

    for layer in network.modules():
        if isinstance(layer, nn.Dropout2d):
            layer.register_forward_hook(record)
    network(image(64, 64))
    expected = {(32, 0.3): drops, (16, 0.3): drops, (8, 0.3): drops, (4, 0.3): 1}
    assert Counter(drop for drop in dropped if drop[1] > 0) == expected
    assert {size for size, rate in dropped if rate == 0} == {64}
