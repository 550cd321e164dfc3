"""BatchNorm of pixels is PyTorch's own, however the channels lie in memory."""

import pytest
import torch
from torch import Tensor, nn

from derain.models.layers.batch_norm import PixelBatchNorm


def gradients(norm: nn.BatchNorm2d, image: Tensor) -> list[Tensor]:
    """Of half of the channels of a concatenation, so that the gradient has gaps."""
    joined = torch.cat([norm(image), image], dim=1)
    return list(torch.autograd.grad(joined.sin().sum(), [image, *norm.parameters()]))


@pytest.mark.parametrize("memory_format", [torch.contiguous_format, torch.channels_last], ids=str)
def test_the_gradient_is_pytorchs(memory_format: torch.memory_format) -> None:
    image = torch.randn(2, 3, 5, 7, dtype=torch.double, generator=torch.Generator().manual_seed(0))
    expected = gradients(nn.BatchNorm2d(3).double(), image.clone().requires_grad_())
    seen = image.contiguous(memory_format=memory_format).requires_grad_()
    found = gradients(PixelBatchNorm(3).double(), seen)
    for one, other in zip(found, expected, strict=True):
        torch.testing.assert_close(one, other)
