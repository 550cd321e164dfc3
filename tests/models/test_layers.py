"""Layers: padding is that of NumPy, BatchNorm that of PyTorch, and so are their gradients."""

import numpy as np
import pytest
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor, nn

from derain.models.layers.batch_norm import PixelBatchNorm
from derain.models.layers.padding import pad_around, pad_to_multiple

SIZES = [(1, 1, 1), (2, 3, 2), (5, 4, 1), (1, 4, 3), (3, 1, 4), (6, 7, 2)]
FORMATS = [torch.contiguous_format, torch.channels_last]


def image_of(height: int, width: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(height)
    return torch.randn(2, 3, height, width, dtype=torch.double, generator=generator)


@pytest.mark.parametrize("memory_format", FORMATS, ids=str)
@pytest.mark.parametrize(("height", "width", "margin"), SIZES)
@pytest.mark.parametrize("gradient", [False, True])
def test_it_goes_round_and_is_mirrored(height, width, margin, gradient, memory_format) -> None:
    image = image_of(height, width)
    wide = np.pad(image, ((0, 0), (0, 0), (0, 0), (margin, margin)), mode="wrap")
    expected = np.pad(wide, ((0, 0), (0, 0), (margin, margin), (0, 0)), mode="reflect")
    seen = image.contiguous(memory_format=memory_format).requires_grad_(gradient)
    np.testing.assert_array_equal(pad_around(seen, margin).detach(), expected)


@pytest.mark.parametrize("memory_format", FORMATS, ids=str)
@pytest.mark.parametrize(("height", "width", "margin"), SIZES)
def test_its_gradient_is_that_of_its_value(height, width, margin, memory_format) -> None:
    image = image_of(height, width).contiguous(memory_format=memory_format).requires_grad_()
    assert torch.autograd.gradcheck(lambda image: pad_around(image, margin), image)


@given(
    height=st.integers(1, 40),
    width=st.integers(1, 40),
    multiple=st.integers(1, 20),
    value=st.sampled_from([0.0, -1.0]),
)
def test_new_pixels_are_below_and_on_the_right(height, width, multiple, value) -> None:
    image = np.random.default_rng(0).normal(size=(2, 3, height, width)).astype(np.float32)
    below = next(n for n in range(multiple) if (height + n) % multiple == 0)
    right = next(n for n in range(multiple) if (width + n) % multiple == 0)
    expected = np.pad(image, ((0, 0), (0, 0), (0, below), (0, right)), constant_values=value)
    padded = pad_to_multiple(torch.from_numpy(image), multiple, value)
    np.testing.assert_array_equal(padded, expected)
    np.testing.assert_array_equal(padded[..., :height, :width], image)


def test_an_image_that_fits_comes_back_as_it_is() -> None:
    image = torch.zeros(1, 2, 32, 48)
    assert pad_to_multiple(image, 16, value=-1.0) is image
    assert pad_to_multiple(image[..., :3].bfloat16(), 4, 0.0).dtype is torch.bfloat16


def gradients(norm: nn.BatchNorm2d, image: Tensor) -> list[Tensor]:
    """Of half of the channels of a concatenation, so that the gradient has gaps."""
    joined = torch.cat([norm(image), image], dim=1)
    return list(torch.autograd.grad(joined.sin().sum(), [image, *norm.parameters()]))


@pytest.mark.parametrize("memory_format", [torch.contiguous_format, torch.channels_last], ids=str)
def test_the_gradient_is_pytorchs(memory_format) -> None:
    image = torch.randn(2, 3, 5, 7, dtype=torch.double, generator=torch.Generator().manual_seed(0))
    expected = gradients(nn.BatchNorm2d(3).double(), image.clone().requires_grad_())
    seen = image.contiguous(memory_format=memory_format).requires_grad_()
    found = gradients(PixelBatchNorm(3).double(), seen)
    for one, other in zip(found, expected, strict=True):
        torch.testing.assert_close(one, other)
