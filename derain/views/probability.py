"""From a network's logits to the probability of rain."""

import numpy as np

from derain.scan import Float32s


def probability_of_rain(logits: Float32s) -> Float32s:
    """Softmax over the two classes, in a form that no logit overflows.

    Args:
        logits: Scores of "not rain" and "rain", float32 (M, 2).

    Returns:
        Probability of rain, float32 (M,).
    """
    margin = logits[:, 1].astype(np.float64) - logits[:, 0]
    return (0.5 + 0.5 * np.tanh(0.5 * margin)).astype(np.float32)
