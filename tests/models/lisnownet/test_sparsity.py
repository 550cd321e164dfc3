"""LiSnowNet's loss has the published values, and is finite for every image."""

import math
from itertools import product

import numpy as np
import pytest
import torch
from torch import Tensor

from derain.models.lisnownet.sparsity import (
    fold_checkerboard,
    fourier_sparsity,
    mean_residual,
    sparsity_loss,
    wavelet_levels,
    wavelet_sparsity,
)


def noise(*shape: int, seed: int = 0) -> Tensor:
    return torch.randn(shape, generator=torch.Generator().manual_seed(seed), dtype=torch.float64)


def checkerboard(size: int, cell: int) -> Tensor:
    """+1 and -1 in square cells, (1, 1, size, size)."""
    stripes = torch.arange(size) // cell % 2
    return (1 - 2 * (stripes[:, None] ^ stripes)).double()[None, None]


def all_valid(image: Tensor) -> Tensor:
    return torch.ones_like(image[:, :1], dtype=torch.bool)


def test_each_part_is_the_published_one(shared) -> None:
    oracle = np.load(shared / "oracles" / "lisnownet.npz")
    image, denoised = torch.from_numpy(oracle["x"]), torch.from_numpy(oracle["y"])
    valid = (image >= 0).any(dim=1, keepdim=True)
    loss = sparsity_loss(denoised, image, valid, alpha=5, beta=0.5)
    for part, published in [("wavelet", "dwt"), ("fourier", "fft"), ("residual", "residual")]:
        assert getattr(loss, part).item() == pytest.approx(float(oracle[published]), abs=1e-4)
    assert wavelet_levels(2 * image.shape[-2], image.shape[-1] // 2) == oracle["dwt_levels"]


@pytest.mark.parametrize(("alpha", "weight"), [(0, 0), (1, 0.5), (5, 0.96875), (5.5, 0.9779029)])
@pytest.mark.parametrize("beta", [0, 0.3, 1])
def test_alpha_and_beta_weigh_the_parts(alpha, weight, beta) -> None:
    denoised, image = noise(2, 2, 16, 32), noise(2, 2, 16, 32, seed=1)
    loss = sparsity_loss(denoised, image, all_valid(image), alpha, beta)
    sparsity = beta * loss.wavelet + (1 - beta) * loss.fourier
    expected = weight * sparsity + (1 - weight) * loss.residual
    torch.testing.assert_close(loss.loss, expected, rtol=1e-6, atol=0)


@pytest.mark.parametrize("width", [1, 2, 7, 8])
@pytest.mark.parametrize("height", [1, 2, 5, 6])
def test_the_checkerboard_is_folded_cell_by_cell(height, width) -> None:
    image = noise(2, 3, height, width)
    even = torch.cat([image, image[..., : width % 2]], dim=-1)
    expected = torch.zeros(2, 3, 2 * height, even.shape[-1] // 2, dtype=torch.float64)
    for row, column in product(range(height), range(even.shape[-1])):
        target = row if (row + column) % 2 else 2 * height - 1 - row
        expected[..., target, column // 2] = even[..., row, column]
    assert torch.equal(fold_checkerboard(image), expected)


@pytest.mark.parametrize(
    ("size", "cell", "expected"), [(8, 1, 2 / 3), (16, 1, 2 / 3), (16, 2, 1 / 6)]
)
def test_a_checkerboard_has_details_along_the_diagonal_of_one_level(size, cell, expected) -> None:
    assert wavelet_sparsity(checkerboard(size, cell)).item() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("height", "width", "levels"),
    [
        *[(128, 1024, 5), (64, 64, 4), (8, 8, 1), (80, 64, 4)],  # as published
        *[(120, 1024, 3), (128, 520, 3), (130, 1024, 1), (128, 1023, 0)],  # an odd side
        *[(4, 4, 0), (2, 1, 0)],  # the published number is below 1
        (2**40, 2**40, 38),
    ],
)
def test_an_image_is_halved_as_published_or_as_often_as_it_can_be(height, width, levels) -> None:
    assert wavelet_levels(height, width) == levels


def test_an_impulse_excites_all_frequencies_alike() -> None:
    image = torch.zeros(1, 1, 8, 32)
    image[..., 0, 0] = 5
    expected = math.log1p(5 / math.sqrt(8 * 32)) / 2  # the imaginary parts are 0
    assert fourier_sparsity(image).item() == pytest.approx(expected)


def test_a_wave_excites_one_frequency() -> None:
    phase = 2 * math.pi * 3 / 32 * torch.arange(32, dtype=torch.float64)
    image = torch.cos(phase).expand(1, 1, 8, 32)
    magnitude = math.sqrt(8 * 32) / 2  # by Parseval: the half spectrum and its mirror share it
    expected = math.log1p(magnitude) / (8 * 17 * 2)
    assert fourier_sparsity(image).item() == pytest.approx(expected)


@pytest.mark.parametrize(
    ("norm", "expected"), [("l1", (0.5 + 0 + 1 + 0.5) / 4), ("l2", (0.25 + 0 + 1 + 0.25) / 4)]
)
def test_the_residual_counts_every_channel_of_every_valid_pixel(norm, expected) -> None:
    image = torch.tensor([[[[1.0, 2.0, math.nan]], [[0.0, 0.5, -1.0]]]])
    denoised = torch.tensor([[[[1.5, 2.0, 7.0]], [[-1.0, 1.0, 9.0]]]])
    valid = torch.tensor([[[[True, True, False]]]])
    residual = mean_residual(denoised, image, valid, norm)
    assert residual.item() == pytest.approx(expected)


def test_images_of_a_batch_count_alike_in_sparsity_and_pixels_in_the_residual() -> None:
    denoised, image = noise(3, 2, 16, 32), noise(3, 2, 16, 32, seed=1)
    valid = torch.rand(3, 1, 16, 32) < torch.tensor([0.9, 0.3, 0.0])[:, None, None, None]
    together = sparsity_loss(denoised, image, valid, alpha=5, beta=0.5)
    alone = [
        sparsity_loss(denoised[[scan]], image[[scan]], valid[[scan]], alpha=5, beta=0.5)
        for scan in range(3)
    ]
    share = valid.sum(dim=(1, 2, 3)) / valid.sum()
    for part in ("wavelet", "fourier"):
        mean = torch.stack([getattr(loss, part) for loss in alone]).mean()
        torch.testing.assert_close(getattr(together, part), mean)
    residual = (torch.stack([loss.residual for loss in alone]) * share).sum()
    torch.testing.assert_close(together.residual, residual)


@pytest.mark.parametrize("share", [0.0, 0.5, 1.0], ids=["empty", "half", "full"])
@pytest.mark.parametrize("value", [None, 0.0, 2.7], ids=["noise", "zero", "constant"])
@pytest.mark.parametrize("size", [(1, 1), (1, 2), (15, 33), (40, 60), (64, 128)])
@pytest.mark.parametrize("norm", ["l1", "l2"])
def test_values_and_gradients_are_finite(size, value, share, norm) -> None:
    image = noise(2, 2, *size).float() if value is None else torch.full((2, 2, *size), value)
    valid = torch.rand(2, 1, *size) < share
    denoised = image.clone().requires_grad_()
    seen = torch.where(valid, image, math.nan)
    loss = sparsity_loss(denoised, seen, valid, alpha=5, beta=0.5, norm=norm)
    loss.loss.backward()
    assert all(part.isfinite() for part in loss)
    assert denoised.grad.isfinite().all()


def test_autocast_takes_nothing_from_its_precision() -> None:
    denoised, image = noise(1, 2, 16, 32).float(), noise(1, 2, 16, 32, seed=1).float()
    arguments = (denoised, image, all_valid(image), 5, 0.5)
    with torch.autocast("cpu", dtype=torch.bfloat16):
        under_autocast = sparsity_loss(*arguments)
    assert under_autocast == sparsity_loss(*arguments)


def test_bfloat16_images_are_summed_in_float32() -> None:
    denoised = noise(1, 2, 16, 32).bfloat16().requires_grad_()
    loss = sparsity_loss(denoised, denoised.detach(), all_valid(denoised), alpha=5, beta=0.5)
    loss.loss.backward()
    assert loss.loss.dtype == torch.float32
    assert denoised.grad.isfinite().all()
