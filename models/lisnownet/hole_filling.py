"""Fills the pixels of a range image that hold no return, as LiSnowNet does before it learns.

Source: M.-Y. Yu, R. Vasudevan, M. Johnson-Roberson, "LiSnowNet: Real-time Snow Removal for LiDAR
Point Clouds", IROS 2022.
"""

import torch
from torch import Tensor
from torch.nn import functional

from derain.learning.losses import at_least_float32
from derain.models.layers.padding import pad_around


def fill_holes(image: Tensor, valid: Tensor) -> Tensor:
    """Gives every empty pixel a value that suits its surroundings; valid pixels keep theirs.

    A pixel beside valid ones takes the greatest of them; any other takes its row's mean plus one
    standard deviation. Where the image bulges, edges are sharpened, and all is smoothed.

    The published formulas hold wherever they are defined. Where they are 0 / 0, in a row without
    any value to take a mean of, that of the whole image stands in, and an image without a valid
    pixel is 0. Values and gradients are finite for the cube root of every finite float32, and
    computed in float32 or wider, under autocast too.

    Args:
        image: float (B, channels, H, W). Values where nothing is valid are never looked at.
        valid: Which pixels hold a return, bool (B, 1, H, W).

    Returns:
        float32 or wider, (B, channels, H, W).
    """
    image = at_least_float32(image)
    nothing = torch.finfo(image.dtype).min
    greatest = functional.max_pool2d(pad_around(torch.where(valid, image, nothing), 1), 3, stride=1)
    known = greatest[:, :1] > nothing
    dense = torch.where(valid, image, greatest)
    dense = torch.where(known, dense, _row_level(dense, known))
    sharpened = dense + functional.relu(_laplacian(dense))
    smoothed = functional.avg_pool2d(pad_around(sharpened, 2), 5, stride=1)
    return torch.where(valid, image, smoothed)


def _row_level(image: Tensor, known: Tensor) -> Tensor:
    """Level of each row's known pixels, or of the image's where the row has none."""
    row = _level(image, known, (-1,))
    whole = _level(image, known, (-2, -1))
    return torch.where(known.any(dim=-1, keepdim=True), row, whole)


def _level(image: Tensor, known: Tensor, dim: tuple[int, ...]) -> Tensor:
    """Mean plus standard deviation of the known pixels; 0 where there are none."""
    count = known.sum(dim, keepdim=True, dtype=image.dtype).clamp(min=1)
    mean = torch.where(known, image, 0).sum(dim, keepdim=True) / count
    deviation = torch.where(known, image - mean, 0)
    # The norm's gradient is 0 at 0, where that of the variance's square root is infinite.
    return mean + torch.linalg.vector_norm(deviation, dim=dim, keepdim=True) / count.sqrt()


def _laplacian(image: Tensor) -> Tensor:
    """Mean of a pixel's eight neighbours less the pixel itself."""
    return (functional.avg_pool2d(pad_around(image, 1), 3, stride=1) - image) * 9 / 8
