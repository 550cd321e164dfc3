"""Recovers the training intensities of a published 3D-OutDet from its first BatchNorm layer.

python -m benchmarks.batchnorm_memory outdet_rehearse3d.pt outdet_wads.pt

A unit of the first convolution is a weighted sum over the nine neighbours of x, y, z, intensity and
distance, and BatchNorm keeps its mean and its variance over the training points. If the neighbours
of a point are much like it, each mean is a linear function of the five means of the input, and each
variance one of its fifteen second moments and of how far neighbours differ; thirty-two units are
more than enough to solve for them by least squares. The weights of WADS, whose input had mean 0 and
standard deviation 1, are the check.
"""

import argparse
from collections.abc import Mapping
from itertools import combinations_with_replacement
from pathlib import Path

import numpy as np
from torch import Tensor

from derain.cards.card import DataCard, load_card
from derain.evaluation.text_tables import markdown_table
from derain.models.published import read_state_dict
from derain.scan import Floats

INTENSITY = 3

# A point's k-th neighbour of nine in a plane is about so far away, over the last of them.
NEIGHBOUR_DISTANCE = np.sqrt(np.arange(9) / 8)


def remembered_intensity(
    state_dict: Mapping[str, Tensor], normalised_as: DataCard
) -> tuple[float, float]:
    """Mean and standard deviation of the intensities that published weights were trained on.

    Args:
        state_dict: Published tensors of 3D-OutDet.
        normalised_as: Data card by whose statistics their input was normalised.

    Returns:
        Both in the unit of that card.
    """
    name = {key.removeprefix("convs.0."): value.numpy() for key, value in state_dict.items()}
    weight, distance = name["conv1.weight"].astype(np.float64), name["conv1.dw"]
    # Float64 (32, 5): what a unit makes of a change that all neighbours have in common. One is
    # added to every distance, whose part is therefore known.
    common = weight.sum(axis=2).T
    common[:, 4] = (weight[4] * distance * NEIGHBOUR_DISTANCE).sum(axis=1)
    known = name["conv1.b"] + (weight[4] * distance).sum(axis=1)
    mean = np.linalg.lstsq(common, name["bn1.running_mean"] - known, rcond=None)[0]

    pairs = list(combinations_with_replacement(range(5), 2))
    moments = [common[:, a] * common[:, b] * (1 if a == b else 2) for a, b in pairs]
    alone = (weight[INTENSITY] ** 2).sum(axis=1)
    apart = ((weight[4] * distance * NEIGHBOUR_DISTANCE) ** 2).sum(axis=1)
    columns = np.stack([*moments, alone, apart], axis=1)
    variance = _relative_least_squares(columns, name["bn1.running_var"])
    shared, own = variance[pairs.index((INTENSITY, INTENSITY))], variance[len(pairs)]
    offset, scale = normalised_as.statistics("intensity")
    return float(offset + scale * mean[INTENSITY]), float(scale * np.sqrt(shared + own))


def _relative_least_squares(columns: Floats, values: Floats) -> Floats:
    """The least squares of relative errors: variances differ by a factor of twenty."""
    solution = np.linalg.lstsq(columns / values[:, None], np.ones(len(values)), rcond=None)[0]
    return np.asarray(solution)


def main() -> None:
    """Prints both for some weights that were trained with the statistics of WADS."""
    parser = argparse.ArgumentParser(description=__doc__.splitlines()[0])
    parser.add_argument("weights", nargs="+", type=Path)
    card = load_card("wads")
    body = []
    for path in parser.parse_args().weights:
        mean, deviation = remembered_intensity(read_state_dict(path), card)
        body.append([path.stem, f"{mean:.1f}", f"{deviation:.1f}"])
    print(markdown_table(["weights", "mean intensity", "standard deviation"], body))


if __name__ == "__main__":
    main()
