"""The weights that the numeric oracles were computed with, drawn by their recipe."""

from collections.abc import Mapping, Sequence

import numpy as np
import torch
from torch import Tensor

from derain.scan import Floats


def recipe_weights(shapes: Mapping[str, Sequence[int]], seed: int) -> dict[str, Tensor]:
    """Draws a state_dict, key by key in sorted order.

    Args:
        shapes: Shape of each tensor of the published state_dict.
        seed: The oracle's seed.

    Returns:
        float32 tensors; the counters ``num_batches_tracked`` are int64 zeros.

    Source: shared/oracles/README.md, "The weight recipe".
    """
    rng = np.random.default_rng(seed)
    return {
        key: torch.zeros((), dtype=torch.int64)
        if key.endswith("num_batches_tracked")
        else torch.from_numpy(_drawn(rng, key, shape).astype(np.float32))
        for key, shape in sorted(shapes.items())
    }


def _drawn(rng: np.random.Generator, key: str, shape: Sequence[int]) -> Floats:
    if key.endswith("running_var"):
        return rng.uniform(0.5, 1.5, shape)
    if key.endswith("running_mean"):
        return rng.normal(0.0, 0.1, shape)
    if len(shape) > 1:
        return rng.normal(0.0, np.prod(shape[1:]) ** -0.5, shape)
    if key.endswith("weight"):
        return rng.uniform(0.8, 1.2, shape)
    return rng.normal(0.0, 0.05, shape)
