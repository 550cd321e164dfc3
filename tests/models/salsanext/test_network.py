"""SalsaNext computes what was published; it and its variant, for images of any size."""

import json
from collections import Counter

import numpy as np
import pytest
import torch
from torch import Tensor, nn
from torch.nn.functional import cross_entropy

from derain.errors import InputError
from derain.models.layers.batch_norm import PixelBatchNorm
from derain.models.salsanext.network import PUBLISHED_KEYS, SalsaNextNetwork, SalsaNextPlan
from derain.models.salsanext_lite import SalsaNextLiteNetwork

from ..conftest import randomise
from ..oracle_weights import recipe_weights


def published(network: nn.Module) -> dict[str, Tensor]:
    """The network's tensors under the published keys."""
    return {PUBLISHED_KEYS[name]: tensor for name, tensor in network.state_dict().items()}


def small(channels: int = 5, width: int = 4, classes: int = 2, seed: int = 0) -> SalsaNextNetwork:
    """A network with weights and statistics that leave no BatchNorm without effect."""
    network = SalsaNextNetwork(channels, width, classes)
    shapes = {key: tensor.shape for key, tensor in published(network).items()}
    return SalsaNextNetwork.from_published(recipe_weights(shapes, seed)).eval()


def image(height: int, width: int, channels: int = 5, scans: int = 1) -> Tensor:
    generator = torch.Generator().manual_seed(height * 1000 + width)
    return torch.randn(scans, channels, height, width, generator=generator)


@torch.no_grad()
def test_the_probabilities_are_those_of_the_published_network(shared) -> None:
    oracle = np.load(shared / "oracles" / "salsanext.npz")
    shapes = json.loads((shared / "oracles" / "shapes.json").read_text())["salsanext"]
    ours = published(SalsaNextNetwork()).items()
    assert {key: list(tensor.shape) for key, tensor in ours} == shapes
    network = SalsaNextNetwork.from_published(recipe_weights(shapes, int(oracle["seed"]))).eval()
    probability = network(torch.from_numpy(oracle["x"])).softmax(dim=1)
    np.testing.assert_allclose(probability, oracle["probability"], rtol=0, atol=1e-6)


@pytest.mark.parametrize(
    ("channels", "width", "classes"), [(5, 8, 2), (2, 16, 2), (7, 2, 20), (1, 6, 1)]
)
@torch.no_grad()
def test_its_size_is_read_from_published_weights(channels, width, classes) -> None:
    network = small(channels, width, classes)
    read = SalsaNextNetwork.from_published(published(network)).eval()
    assert (read.channels, read.width, read.classes) == (channels, width, classes)
    seen = image(16, 32, channels)
    assert read(seen).shape == (1, classes, 16, 32)
    torch.testing.assert_close(read(seen), network(seen), rtol=0, atol=0)


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"downCntx.conv1.weight": torch.zeros(4, 5)}, "context.0.shortcut.weight"),
        ({"downCntx.conv1.bias": torch.zeros(0)}, "width"),
        ({"downCntx.conv1.bias": torch.zeros(7)}, "width"),
        ({"logits.bias": torch.zeros(3)}, "head.weight"),
    ],
)
def test_weights_of_another_network_are_refused(change, reason) -> None:
    with pytest.raises(InputError, match=reason):
        SalsaNextNetwork.from_published({**published(small()), **change})


@pytest.mark.parametrize(
    ("kind", "widths"), [(SalsaNextNetwork, (-2, 0, 1, 31)), (SalsaNextLiteNetwork, (-2, 0))]
)
def test_a_width_of_nothing_or_that_cannot_be_halved_is_refused(kind, widths) -> None:
    for width in widths:
        with pytest.raises(InputError, match=f"width: {width} is not"):
            kind(width=width)


def test_the_exported_network_spends_nothing_on_sizes_that_fit() -> None:
    def operators(seen: Tensor) -> Counter[str]:
        nodes = torch.export.export(small(), (seen,)).graph.nodes
        return Counter(str(node.target).rpartition(".")[0] for node in nodes)

    changing_size = {"aten.pad", "aten.slice"}
    assert changing_size <= operators(image(20, 37)).keys()
    fitting = operators(image(16, 32))
    assert fitting["aten.conv2d"] == 51
    assert not fitting.keys() & changing_size


both = pytest.mark.parametrize("kind", [SalsaNextNetwork, SalsaNextLiteNetwork])


def random_one(kind: type[SalsaNextPlan], width: int = 4) -> SalsaNextPlan:
    """A network with weights and statistics that leave no BatchNorm without effect."""
    network = kind(channels=5, width=width)
    randomise(network, seed=0)
    return network.eval()


def step(network: nn.Module, batch: Tensor) -> None:
    """Computes the gradients of a training step, all of which are finite."""
    loss = cross_entropy(network.train()(batch), (batch[:, 0] > 0).long())
    loss.backward()
    assert loss.isfinite()
    for name, parameter in network.named_parameters():
        assert parameter.grad.isfinite().all(), name


@both
@pytest.mark.parametrize(("height", "width"), [(1, 1), (2, 17), (15, 16), (20, 37), (32, 48)])
@torch.no_grad()
def test_an_image_of_any_size_counts_as_continued_by_empty_pixels(kind, height, width) -> None:
    network, seen = random_one(kind), image(height, width)
    padded = torch.zeros(1, 5, -(-height // 16) * 16, -(-width // 16) * 16)
    padded[..., :height, :width] = seen
    logits = network(seen)
    assert logits.shape == (1, 2, height, width)
    torch.testing.assert_close(logits, network(padded)[..., :height, :width], rtol=0, atol=0)


@torch.no_grad()
def test_the_lite_network_folds_to_one_that_computes_the_same_without_a_batch_norm() -> None:
    network, seen = random_one(SalsaNextLiteNetwork, width=8), image(32, 64)
    kept = {name: tensor.clone() for name, tensor in network.state_dict().items()}
    folded = network.folded()
    assert not any(isinstance(layer, PixelBatchNorm) for layer in folded.modules())
    torch.testing.assert_close(folded(seen), network(seen), rtol=1e-4, atol=1e-5)
    # The one that goes on being trained is left as it was.
    assert network.state_dict().keys() == kept.keys()
    assert all(torch.equal(network.state_dict()[name], kept[name]) for name in kept)


@both
@pytest.mark.parametrize(
    ("scans", "height", "width"), [(1, 1, 1), (1, 16, 16), (2, 16, 16), (1, 20, 37)]
)
def test_a_training_step_on_small_images_is_finite(kind, scans, height, width) -> None:
    step(random_one(kind), image(height, width, scans=scans))


@both
def test_the_gradient_reaches_every_parameter(kind) -> None:
    network = random_one(kind, width=8)
    # At the bottleneck 3×3 pixels: in fewer, some taps of its kernels only ever see the padding.
    step(network, image(48, 48, scans=2))
    assert all(parameter.grad.any() for parameter in network.parameters())


@pytest.mark.parametrize(
    ("kind", "drops"),
    # On the way down; on the way up before and after the layers, and, in SalsaNext, the joint.
    [(SalsaNextNetwork, 4), (SalsaNextLiteNetwork, 3)],
)
def test_features_are_dropped_everywhere_but_at_full_resolution(kind, drops) -> None:
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
