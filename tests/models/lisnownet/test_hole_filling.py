"""Holes are filled as published where that is defined, and with stated values where it is not."""

from pathlib import Path

import numpy as np
import pytest
import torch
from numpy.lib.stride_tricks import sliding_window_view
from numpy.typing import NDArray
from torch import Tensor

from derain.models.lisnownet.network import fill_holes


def scene(height: int, width: int, share: float, seed: int = 0) -> tuple[Tensor, Tensor]:
    """A random image of two channels and which of its pixels are valid."""
    generator = torch.Generator().manual_seed(seed)
    image = 4 * torch.rand(1, 2, height, width, generator=generator, dtype=torch.float64)
    return image, torch.rand(1, 1, height, width, generator=generator) < share


def neighbourhoods(image: NDArray[np.float64], size: int) -> NDArray[np.float64]:
    """(2, H, W, size, size), edges continued by NumPy."""
    margin = size // 2
    image = np.pad(image, ((0, 0), (0, 0), (margin, margin)), mode="wrap")
    image = np.pad(image, ((0, 0), (margin, margin), (0, 0)), mode="reflect")
    return sliding_window_view(image, (size, size), axis=(1, 2))


def as_published(image: NDArray[np.float64]) -> NDArray[np.float64]:
    """The published formula, where empty pixels are -1; NaN where it is 0 / 0."""
    valid: NDArray[np.bool_] = np.any(image >= 0, axis=0)
    dense = np.where(valid, image, neighbourhoods(image, 3).max(axis=(3, 4)))
    known: NDArray[np.bool_] = np.any(dense >= 0, axis=0)
    for channel, row in np.ndindex(dense.shape[:2]):
        values = dense[channel, row, known[row]]
        level = values.mean() + values.std() if len(values) else np.nan
        dense[channel, row, ~known[row]] = level
    around = neighbourhoods(dense, 3).sum(axis=(3, 4)) - dense
    sharpened = dense + np.maximum(around / 8 - dense, 0)
    return np.where(valid, image, neighbourhoods(sharpened, 5).mean(axis=(3, 4)))


def test_the_filled_image_is_the_published_one(shared: Path) -> None:
    oracle = np.load(shared / "oracles" / "lisnownet.npz")
    image = torch.from_numpy(oracle["x"])
    filled = fill_holes(image, (image >= 0).any(dim=1, keepdim=True))
    np.testing.assert_allclose(filled, oracle["filled"], rtol=0, atol=1e-5)


@pytest.mark.parametrize(("height", "width"), [(3, 2), (4, 7), (16, 64)])
@pytest.mark.parametrize("share", [0.9, 0.4, 0.15])
def test_holes_are_filled_by_the_published_formula(height: int, width: int, share: float) -> None:
    image, valid = scene(height, width, share)
    valid[..., ::2, 0] = True  # a value in every row after the first step
    expected = as_published(torch.where(valid, image, -1)[0].numpy())
    np.testing.assert_allclose(fill_holes(image, valid)[0], expected, atol=1e-12)


@pytest.mark.parametrize("rubbish", [-1.0, 0.0, 1e30, np.nan, np.inf, -np.inf])
def test_what_empty_pixels_hold_does_not_matter(rubbish: float) -> None:
    image, valid = scene(16, 32, 0.3)
    filled = fill_holes(torch.where(valid, image, rubbish), valid)
    assert torch.equal(filled, fill_holes(image, valid))


def test_a_row_far_from_any_value_takes_the_level_of_the_whole_image() -> None:
    image, valid = scene(12, 16, 1.0)
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
def test_an_image_without_a_return_is_zero(size: tuple[int, int]) -> None:
    image, valid = scene(*size, share=0)
    assert torch.equal(fill_holes(image, valid), torch.zeros_like(image))


def test_a_single_return_fills_the_whole_image() -> None:
    image, valid = scene(16, 32, 0.0)
    valid[..., 5, 0] = True
    expected = image[..., 5:6, 0:1].expand_as(image)
    torch.testing.assert_close(fill_holes(image, valid), expected)


@pytest.mark.parametrize("share", [0.0, 0.01, 0.3, 1.0])
@pytest.mark.parametrize("value", [None, 0.0, 2.7])
def test_gradients_are_finite(share: float, value: float | None) -> None:
    image, valid = scene(16, 32, share)
    image = image.float() if value is None else torch.full((1, 2, 16, 32), value)
    valid[..., 3:10, :] = False
    image.requires_grad_()
    fill_holes(image, valid).square().sum().backward()
    assert image.grad is not None
    assert image.grad.isfinite().all()


@pytest.mark.parametrize("largest", [1e-38, 1e4, 3e38])
def test_ranges_of_every_size_stay_finite(largest: float) -> None:
    image, valid = scene(16, 32, 0.3)
    image = (image.float() / 4 * largest) ** (1 / 3)
    image.requires_grad_()
    filled = fill_holes(image, valid)
    filled.sum().backward()
    assert filled.isfinite().all()
    assert image.grad is not None
    assert image.grad.isfinite().all()


def test_autocast_takes_nothing_from_its_precision() -> None:
    image, valid = scene(16, 32, 0.3)
    image = image.float()
    with torch.autocast("cpu", dtype=torch.bfloat16):
        filled = fill_holes(image, valid)
    assert torch.equal(filled, fill_holes(image, valid))
    assert fill_holes(image.bfloat16(), valid).dtype == torch.float32
