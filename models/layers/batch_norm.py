"""BatchNorm that also takes the smallest of scans."""

import torch
from torch import Tensor, nn
from torch.nn import functional


class _Lenient:
    """Leaves a batch of fewer than two values per channel to the running statistics.

    One value has no variance; PyTorch's own raises an error there.
    """

    def forward(self, features: Tensor) -> Tensor:
        """Normalises float (M, channels, ...)."""
        assert isinstance(self, nn.BatchNorm1d | nn.BatchNorm2d)
        if self.training and features[:, :1].numel() < 2:
            return functional.batch_norm(
                features, self.running_mean, self.running_var, self.weight, self.bias, eps=self.eps
            )
        return super().forward(features)  # type: ignore[misc]


class PointBatchNorm(_Lenient, nn.BatchNorm1d):
    """For points, (M, channels); none and one included."""


class PixelBatchNorm(_Lenient, nn.BatchNorm2d):
    """For pixels, (B, channels, H, W); a single one included, as a small image ends in."""

    def forward(self, features: Tensor) -> Tensor:
        """Normalises float (B, channels, H, W)."""
        normalised = super().forward(features)
        is_channels_last = normalised.is_contiguous(memory_format=torch.channels_last)
        if normalised.requires_grad and is_channels_last:
            normalised.register_hook(_dense)
        return normalised


def _dense(gradient: Tensor) -> Tensor:
    """A gradient without gaps, such as one of several that came out of a concatenation has.

    PyTorch's BatchNorm takes five times as long where there are any.
    """
    return gradient.contiguous(memory_format=torch.channels_last)
