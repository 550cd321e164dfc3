"""Padding continues an image as NumPy does, and its gradient is that of NumPy's copies."""

import numpy as np
import pytest
import torch

from derain.models.layers.padding import pad_around

SIZES = [(1, 1, 1), (2, 3, 2), (5, 4, 1), (1, 4, 3), (3, 1, 4), (6, 7, 2)]
FORMATS = [torch.contiguous_format, torch.channels_last]


def image_of(height: int, width: int) -> torch.Tensor:
    generator = torch.Generator().manual_seed(height)
    return torch.randn(2, 3, height, width, dtype=torch.double, generator=generator)


@pytest.mark.parametrize("memory_format", FORMATS, ids=str)
@pytest.mark.parametrize(("height", "width", "margin"), SIZES)
@pytest.mark.parametrize("gradient", [False, True])
def test_it_goes_round_and_is_mirrored(
    height: int, width: int, margin: int, gradient: bool, memory_format: torch.memory_format
) -> None:
    image = image_of(height, width)
    wide = np.pad(image, ((0, 0), (0, 0), (0, 0), (margin, margin)), mode="wrap")
    expected = np.pad(wide, ((0, 0), (0, 0), (margin, margin), (0, 0)), mode="reflect")
    seen = image.contiguous(memory_format=memory_format).requires_grad_(gradient)
    np.testing.assert_array_equal(pad_around(seen, margin).detach(), expected)


@pytest.mark.parametrize("memory_format", FORMATS, ids=str)
@pytest.mark.parametrize(("height", "width", "margin"), SIZES)
def test_its_gradient_is_that_of_its_value(
    height: int, width: int, margin: int, memory_format: torch.memory_format
) -> None:
    image = image_of(height, width).contiguous(memory_format=memory_format).requires_grad_()
    assert torch.autograd.gradcheck(lambda image: pad_around(image, margin), image)
