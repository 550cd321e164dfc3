"""The Haar transform is orthonormal and loses nothing."""

import numpy as np
import torch
from hypothesis import given
from hypothesis import strategies as st
from torch import Tensor

from derain.models.lisnownet.network import haar, inverse_haar


@st.composite
def images(draw: st.DrawFn) -> Tensor:
    scans, channels, rows, columns = (draw(st.integers(1, top)) for top in (2, 3, 5, 5))
    generator = torch.Generator().manual_seed(draw(st.integers(0, 2**32)))
    shape = (scans, channels, 2 * rows, 2 * columns)
    return torch.randn(shape, generator=generator, dtype=torch.float64)


@given(images())
def test_each_is_the_inverse_of_the_other(image: Tensor) -> None:
    bands = haar(image)
    torch.testing.assert_close(inverse_haar(bands), image)
    torch.testing.assert_close(haar(inverse_haar(bands)), bands)


@given(images())
def test_energy_and_angles_are_kept(image: Tensor) -> None:
    other = image.flip(-1).roll(1, dims=-2)
    torch.testing.assert_close((haar(image) * haar(other)).sum(), (image * other).sum())
    torch.testing.assert_close(haar(image).norm(), image.norm())


def test_each_block_is_multiplied_by_the_basis() -> None:
    basis = np.array([[1, 1, 1, 1], [1, 1, -1, -1], [1, -1, 1, -1], [1, -1, -1, 1]]) / 2
    image = torch.randn(2, 3, 6, 10, dtype=torch.float64)
    bands = haar(image).unflatten(1, (4, 3)).numpy()
    for row, column in np.ndindex(3, 5):
        block = image[..., 2 * row : 2 * row + 2, 2 * column : 2 * column + 2].flatten(-2).numpy()
        expected = np.einsum("bp,scp->sbc", basis, block)
        np.testing.assert_allclose(bands[..., row, column], expected)


def test_bands_stand_one_after_the_other_with_all_channels_each() -> None:
    left_right = torch.tensor([[1.0, -1.0], [1.0, -1.0]])
    image = torch.stack([torch.ones(2, 2), left_right])[None]
    expected = torch.zeros(8)
    expected[0], expected[5] = 2, 2  # average of channel 0, left to right of channel 1
    torch.testing.assert_close(haar(image).flatten(), expected)
