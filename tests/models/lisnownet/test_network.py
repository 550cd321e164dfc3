"""LiSnowNet's network computes what was published, for images of any size and content."""

import json

import numpy as np
import pytest
import torch
from numpy.lib.stride_tricks import sliding_window_view
from torch import Tensor, nn

from derain.errors import InputError
from derain.models.lisnownet.network import (
    LiSnowNetwork,
    fill_holes,
    haar,
    inverse_haar,
    published_key,
)
from derain.models.lisnownet.sparsity import sparsity_loss
from derain.scan import Bools, Floats

from ..oracle_weights import recipe_weights


def published(network: nn.Module) -> dict[str, Tensor]:
    """The network's tensors under the published keys."""
    return {published_key(name): tensor for name, tensor in network.state_dict().items()}


def small(width: int = 4, seed: int = 0) -> LiSnowNetwork:
    """A network with weights and statistics that leave no BatchNorm without effect."""
    shapes = {key: tensor.shape for key, tensor in published(LiSnowNetwork(width)).items()}
    return LiSnowNetwork.from_published(recipe_weights(shapes, seed)).eval()


def scene(height: int, width: int, share: float = 0.7, scans: int = 1) -> tuple[Tensor, Tensor]:
    """Random images of two channels and which of their pixels are valid."""
    generator = torch.Generator().manual_seed(height * 1000 + width)
    image = 4 * torch.rand(scans, 2, height, width, generator=generator)
    return image, torch.rand(scans, 1, height, width, generator=generator) < share


IMAGE, VALID = scene(32, 48)
CONSTANT, EVERYTHING = torch.full_like(IMAGE, 2.5), torch.ones_like(VALID)
ONE_RETURN = torch.zeros_like(VALID)
ONE_RETURN[..., 7, 0] = True

# Images of next to no variation, which BatchNorm divides by. They are of a size that fits the
# halvings, where a constant image stays constant.
FLAT = {
    "one return": (IMAGE, ONE_RETURN),
    "constant with holes": (CONSTANT, VALID),
    "constant but for one hole": (CONSTANT, ~ONE_RETURN),
    "next to constant": (2.5 + 1e-4 * IMAGE, EVERYTHING),
    "zero": (torch.zeros_like(IMAGE), EVERYTHING),
}


@torch.no_grad()
def test_the_image_is_that_of_the_published_network(shared) -> None:
    oracle = np.load(shared / "oracles" / "lisnownet.npz")
    shapes = json.loads((shared / "oracles" / "shapes.json").read_text())["lisnownet"]
    ours = published(LiSnowNetwork()).items()
    assert {key: list(tensor.shape) for key, tensor in ours} == shapes
    network = LiSnowNetwork.from_published(recipe_weights(shapes, int(oracle["seed"]))).eval()
    image = torch.from_numpy(oracle["x"])
    denoised = network(image, (image >= 0).any(dim=1, keepdim=True))
    np.testing.assert_allclose(denoised, oracle["y"], rtol=0, atol=1e-4)


@pytest.mark.parametrize("width", [1, 2, 4])
@torch.no_grad()
def test_its_size_is_read_from_published_weights(width) -> None:
    network = small(width)
    read = LiSnowNetwork.from_published(published(network)).eval()
    image, valid = torch.rand(1, 2, 16, 32), torch.rand(1, 1, 16, 32) < 0.5
    assert torch.equal(read(image, valid), network(image, valid))


@pytest.mark.parametrize(
    ("change", "reason"),
    [
        ({"enc2.1.shortcut.conv.weight": torch.zeros(4, 4, 3, 3)}, "encoder.2.1.shortcut"),
        ({"dec0.2.bias": torch.zeros(0)}, "another network"),
        ({"dec0.0.main_block.0.bn.bias": torch.zeros(0)}, "width"),
        ({"dec0.2.bias": torch.zeros(3)}, "another network"),
    ],
)
def test_weights_of_another_network_are_refused(change, reason) -> None:
    with pytest.raises(InputError, match=reason):
        LiSnowNetwork.from_published({**published(small()), **change})


@pytest.mark.parametrize(
    ("height", "width"), [(1, 1), (2, 17), (15, 16), (16, 16), (20, 37), (32, 48)]
)
@torch.no_grad()
def test_an_image_of_any_size_counts_as_continued_by_empty_pixels(height, width) -> None:
    network, (image, valid) = small(), scene(height, width)
    size = (-(-height // 16) * 16, -(-width // 16) * 16)
    padded, padded_valid = torch.full((1, 2, *size), -1.0), torch.zeros(1, 1, *size).bool()
    padded[..., :height, :width], padded_valid[..., :height, :width] = image, valid
    denoised = network(image, valid)
    assert denoised.isfinite().all()
    assert torch.equal(denoised, network(padded, padded_valid)[..., :height, :width])


@torch.no_grad()
def test_a_turn_of_the_sensor_turns_the_image() -> None:
    network, (image, valid) = small(), scene(32, 64)
    turned = network(image.roll(16, dims=-1), valid.roll(16, dims=-1))
    torch.testing.assert_close(turned, network(image, valid).roll(16, dims=-1))


def test_channels_are_dropped_in_training_alone() -> None:
    network, seen = small().train(), scene(32, 48, scans=2)
    assert not torch.equal(network(*seen), network(*seen))
    undropped = LiSnowNetwork(width=4, dropout=0).train()
    assert torch.equal(undropped(*seen), undropped(*seen))
    network.eval()
    assert torch.equal(network(*seen), network(*seen))


@pytest.mark.parametrize("case", FLAT)
@pytest.mark.parametrize("bfloat16", [False, True], ids=["float32", "bfloat16"])
def test_a_training_step_on_a_flat_image_is_small(case, bfloat16) -> None:
    network, (image, valid) = small().train(), FLAT[case]
    with torch.autocast("cpu", dtype=torch.bfloat16, enabled=bfloat16):
        denoised = network(image, valid)
        loss = sparsity_loss(denoised, image, valid, alpha=5, beta=0.5)
    loss.loss.backward()
    assert denoised.dtype == torch.float32
    assert all(part.isfinite() for part in loss)
    # NaN is not below anything, either.
    assert all(parameter.grad.abs().max() < 1e3 for parameter in network.parameters())


def test_an_image_without_variation_leaves_the_others_their_gradient() -> None:
    network, gradients = small(), []
    for images, valids in [
        ([IMAGE], [VALID]),
        ([IMAGE, CONSTANT], [VALID, EVERYTHING]),
        ([CONSTANT, IMAGE], [EVERYTHING, VALID]),
    ]:
        # In evaluation mode scans do not see each other, and yet the step is a training one.
        network.zero_grad()
        network.training = True
        network(torch.cat(images), torch.cat(valids)).mean().mul(len(images)).backward()
        gradients.append([parameter.grad.clone() for parameter in network.parameters()])
    torch.testing.assert_close(gradients[1], gradients[0], rtol=1e-4, atol=1e-5)
    torch.testing.assert_close(gradients[2], gradients[0], rtol=1e-4, atol=1e-5)


def test_the_gradient_reaches_every_parameter() -> None:
    network, (image, valid) = small(), scene(64, 64, scans=2)
    sparsity_loss(network(image, valid), image, valid, alpha=5, beta=0.5).loss.backward()
    for name, parameter in network.named_parameters():
        assert parameter.grad.any(), name


def test_each_block_is_multiplied_by_the_basis_which_is_its_own_inverse() -> None:
    basis = np.array([[1, 1, 1, 1], [1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 2
    image = torch.randn(2, 3, 6, 10, dtype=torch.float64)
    bands = haar(image).unflatten(1, (4, 3)).numpy()
    for row, column in np.ndindex(3, 5):
        block = image[..., 2 * row : 2 * row + 2, 2 * column : 2 * column + 2].flatten(-2).numpy()
        expected = np.einsum("bp,scp->sbc", basis, block)
        np.testing.assert_allclose(bands[..., row, column], expected)
    torch.testing.assert_close(inverse_haar(haar(image)), image)


def neighbourhoods(image: Floats, size: int) -> Floats:
    """(2, H, W, size, size), edges continued by NumPy."""
    margin = size // 2
    image = np.pad(image, ((0, 0), (0, 0), (margin, margin)), mode="wrap")
    image = np.pad(image, ((0, 0), (margin, margin), (0, 0)), mode="reflect")
    return sliding_window_view(image, (size, size), axis=(1, 2))


def as_published(image: Floats) -> Floats:
    """The published formula, where empty pixels are -1; NaN where it is 0 / 0."""
    valid: Bools = np.any(image >= 0, axis=0)
    dense = np.where(valid, image, neighbourhoods(image, 3).max(axis=(3, 4)))
    known: Bools = np.any(dense >= 0, axis=0)
    for channel, row in np.ndindex(dense.shape[:2]):
        values = dense[channel, row, known[row]]
        level = values.mean() + values.std() if len(values) else np.nan
        dense[channel, row, ~known[row]] = level
    around = neighbourhoods(dense, 3).sum(axis=(3, 4)) - dense
    sharpened = dense + np.maximum(around / 8 - dense, 0)
    return np.where(valid, image, neighbourhoods(sharpened, 5).mean(axis=(3, 4)))


@pytest.mark.parametrize(("height", "width"), [(3, 2), (4, 7), (16, 64)])
@pytest.mark.parametrize("share", [0.9, 0.4, 0.15])
def test_holes_are_filled_by_the_published_formula(height, width, share) -> None:
    image, valid = scene(height, width, share)
    image = image.double()
    valid[..., ::2, 0] = True  # a value in every row after the first step
    expected = as_published(torch.where(valid, image, -1)[0].numpy())
    np.testing.assert_allclose(fill_holes(image, valid)[0], expected, atol=1e-12)


@pytest.mark.parametrize("rubbish", [-1.0, 0.0, 1e30, np.nan, np.inf, -np.inf])
def test_what_empty_pixels_hold_does_not_matter(rubbish) -> None:
    image, valid = scene(16, 32, 0.3)
    filled = fill_holes(torch.where(valid, image, rubbish), valid)
    assert torch.equal(filled, fill_holes(image, valid))


def test_a_row_far_from_any_value_takes_the_level_of_the_whole_image() -> None:
    image, valid = scene(12, 16, 1.0)
    image = image.double()
    valid[..., 2:11, :] = False
    rows = [0, 1, 2, 10, 11]  # those with values once holes beside valid pixels are filled
    grown = image[0].numpy().copy()
    grown[:, [2, 10]] = neighbourhoods(torch.where(valid, image, -1)[0].numpy(), 3).max(
        axis=(3, 4)
    )[:, [2, 10]]
    values = grown[:, rows].reshape(2, -1)
    level = values.mean(axis=1) + values.std(axis=1)
    filled = fill_holes(image, valid)[0, :, 6].numpy()
    np.testing.assert_allclose(filled, np.repeat(level[:, None], 16, axis=1))


@pytest.mark.parametrize("size", [(1, 1), (2, 3), (16, 32)])
def test_an_image_without_a_return_is_zero(size) -> None:
    image, valid = scene(*size, share=0)
    assert torch.equal(fill_holes(image, valid), torch.zeros_like(image))


def test_a_single_return_fills_the_whole_image() -> None:
    image, valid = scene(16, 32, 0.0)
    valid[..., 5, 0] = True
    expected = image[..., 5:6, 0:1].expand_as(image)
    torch.testing.assert_close(fill_holes(image, valid), expected)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 1.0])
@pytest.mark.parametrize("largest", [0.0, 1e-38, 1e4, 3e38])
def test_ranges_of_every_size_stay_finite(share, largest) -> None:
    image, valid = scene(16, 32, share)
    valid[..., 3:10, :] = False
    image = (image / 4 * largest) ** (1 / 3)
    image.requires_grad_()
    filled = fill_holes(image, valid)
    filled.sum().backward()
    assert filled.isfinite().all()
    assert image.grad.isfinite().all()


def test_autocast_takes_nothing_from_the_precision_of_what_is_filled() -> None:
    image, valid = scene(16, 32, 0.3)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        filled = fill_holes(image, valid)
    assert torch.equal(filled, fill_holes(image, valid))
    assert fill_holes(image.bfloat16(), valid).dtype == torch.float32
