"""LiSnowNet as it is deployed: from a raw range image to what is rain, by its selection rule."""

import torch
from torch import Tensor, nn

from derain.models.lisnownet.network import LiSnowNetwork
from derain.models.lisnownet.selection_rule import SelectionRule
from derain.models.range_module import per_pixel

# How surely a residual of twice the rule's threshold is rain: its logit.
STEEPNESS = 4.0

# Logit of what the rule decides whatever the residual is.
CERTAIN = 20.0


class DeployedLiSnowNet(nn.Module):
    """The network with its selection rule: from a raw range image to logits of its pixels.

    Args:
        network: A trained network.
        rule: What it calls rain.
    """

    def __init__(self, network: LiSnowNetwork, rule: SelectionRule) -> None:
        super().__init__()
        self.network = network
        self.rule = rule

    def forward(self, image: Tensor, valid: Tensor) -> Tensor:
        """Scores every pixel; arguments and result as for :class:`LiSnowNet`."""
        seen = cube_roots(image, self.rule)
        return rain_logits(image, valid, seen, self.network(seen, valid), self.rule)


def cube_roots(image: Tensor, rule: SelectionRule) -> Tensor:
    """What the network sees: cube roots of range and of intensity, in 0..1, float (B, 2, H, W).

    Args:
        image: Range (m), z (m) and intensity (the data's unit), float (B, 3, H, W).
        rule: Its full scale of intensity.
    """
    share = (image[:, 2:] / rule.full_scale).clamp(0, 1)
    return torch.cat([image[:, :1], share], dim=1) ** (1 / 3)


def rain_logits(
    image: Tensor, valid: Tensor, seen: Tensor, denoised: Tensor, rule: SelectionRule
) -> Tensor:
    """Logits of "not rain" and "rain" of every pixel, float (B · H · W, 2), row by row.

    The published rule says yes or no. Here its answer is that of a probability of one half, which
    the residual moves. A pixel without a return is not rain.

    Args:
        image: Range (m), z (m) and intensity (the data's unit), float (B, 3, H, W).
        valid: Pixels with a return, bool (B, 1, H, W).
        seen: What the network saw, float (B, 2, H, W).
        denoised: What it made of that, float (B, 2, H, W).
        rule: The rule.
    """
    excess = denoising_change(seen, denoised) / rule.residual - 1
    margin = (STEEPNESS * excess).clamp(-CERTAIN, CERTAIN)
    margin = torch.where(may_be_rain(image, rule), margin, -CERTAIN)
    margin = torch.where(image[:, :1] < rule.near, CERTAIN, margin)
    margin = torch.where(valid, margin, -CERTAIN)
    return per_pixel(torch.cat([-margin, margin], dim=1) / 2)


def denoising_change(seen: Tensor, denoised: Tensor) -> Tensor:
    """What denoising changed: of range, times that of intensity cubed, float (B, 1, H, W)."""
    of_range, of_intensity = (denoised - seen).split(1, dim=1)
    return of_range * of_intensity**3


def may_be_rain(image: Tensor, rule: SelectionRule) -> Tensor:
    """Which pixels may be rain by their height and intensity, bool (B, 1, H, W)."""
    _, height, intensity = image.split(1, dim=1)
    return (height > rule.ground) & (intensity < rule.intensity * rule.full_scale)
