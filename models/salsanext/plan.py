"""The plan of SalsaNext: an image halved four times and doubled again, joined at every size.

Source: T. Cortinhal, G. Tzelepis, E. E. Aksoy, "SalsaNext: Fast, Uncertainty-aware Semantic
Segmentation of LiDAR Point Clouds for Autonomous Driving", ISVC 2020; TiagoCortinhal/SalsaNext
(MIT).
"""

from torch import Tensor, nn

from derain.models.layers.image_size import pad_to_multiple

# The image is halved four times.
STRIDE = 16


class SalsaNextPlan(nn.Module):
    """How features go from block to block, whatever the blocks are made of.

    Attributes:
        context: What is done at full resolution.
        encoder: A block for each size, from full resolution downwards.
        halve: What halves the image after each of them.
        bottleneck: What is done to the smallest image.
        decoder: A block for each size upwards: takes features, and the encoder's of its size.
        head: From features to scores.
    """

    context: nn.Module
    encoder: nn.ModuleList
    halve: nn.ModuleList
    bottleneck: nn.Module
    decoder: nn.ModuleList
    head: nn.Module

    def forward(self, image: Tensor) -> Tensor:
        """Scores every pixel.

        Args:
            image: Normalised range image, 0 in every channel where there is no return, float
                (B, channels, H, W). Where a side is no multiple of 16, it counts as continued by
                empty pixels at the bottom and on the right.

        Returns:
            Logits, float (B, classes, H, W).
        """
        height, width = image.shape[-2:]
        features = self.context(pad_to_multiple(image, STRIDE, value=0.0))
        skips = []
        for block, halve in zip(self.encoder, self.halve, strict=True):
            skips.append(block(features))
            features = halve(skips[-1])
        features = self.bottleneck(features)
        for block, skip in zip(self.decoder, reversed(skips), strict=True):
            features = block(features, skip)
        scores: Tensor = self.head(features)[..., :height, :width]
        return scores
