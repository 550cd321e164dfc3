"""Images of any size for networks that halve them several times."""

from torch import Tensor
from torch.nn import functional


def pad_to_multiple(image: Tensor, multiple: int, value: float) -> Tensor:
    """Pads an image at the bottom and on the right until its sides are multiples.

    An image that fits comes back as it is. To undo it, slice: ``[..., :height, :width]``.

    Args:
        image: Image, (B, channels, H, W).
        multiple: What both sides shall be multiples of, in pixels.
        value: What the new pixels hold, in every channel.

    Returns:
        Image of the same dtype, (B, channels, ≥ H, ≥ W).
    """
    height, width = image.shape[-2:]
    below, right = -height % multiple, -width % multiple
    if not (below or right):
        return image
    return functional.pad(image, (0, right, 0, below), value=value)
