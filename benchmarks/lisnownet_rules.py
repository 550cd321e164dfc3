"""Error of one LiSnowNet under several selection rules, on labelled scans.

The network was trained without labels, and so were the constants of its own rule; this shows what
others would have given, the published ones among them.

python benchmarks/lisnownet_rules.py lisnownet.ckpt WADS/sample.bin
"""

import argparse
from collections.abc import Mapping
from pathlib import Path

import numpy as np
import torch
from labelled import read_labelled

from derain.cards.card import load_card
from derain.evaluation.counts import SCORES, Counts
from derain.evaluation.text_tables import markdown_table
from derain.models.checkpoint import load_model
from derain.models.lisnownet import LiSnowNet
from derain.models.lisnownet.selection_rule import SelectionRule
from derain.scan import Scan
from derain.views.probability import probability_of_rain

# Source: umautobots/lisnownet for WADS.
PUBLISHED = {"residual": 0.008, "ground": -1.8, "intensity": 2 / 255, "near": 2.5}


def main() -> None:
    """Prints the table."""
    parser = argparse.ArgumentParser(description=__doc__)
    parser.add_argument("checkpoint", type=Path)
    parser.add_argument("scans", type=Path, nargs="+")
    arguments = parser.parse_args()

    model = load_model(arguments.checkpoint)
    assert isinstance(model, LiSnowNet)
    scans = [read_labelled(path) for path in arguments.scans]
    own = model.selection.as_dict()
    rules: dict[str, Mapping[str, float]] = {
        "its own": {},
        "published for WADS": PUBLISHED,
        "without the limit of height": {"ground": -1e9},
        "without the limit of intensity": {"intensity": 2.0},
        **{f"residual {value:g}": {"residual": value} for value in np.geomspace(5e-4, 0.128, 9)},
    }
    body = []
    for name, changes in rules.items():
        model.selection = SelectionRule(**{**own, **changes})
        counts = _counts(model, scans)
        body.append([name, *(f"{getattr(counts, score):.3f}" for score in SCORES)])
    print(markdown_table(["rule", "P", "R", "F1", "IoU"], body))
    print(own)


def _counts(model: LiSnowNet, scans: list[Scan]) -> Counts:
    view = model.spec.make_view()
    card = load_card("wads")
    total = Counts()
    for scan in scans:
        seen = view(scan)
        with torch.inference_mode():
            logits = model(**{name: torch.from_numpy(a) for name, a in seen.inputs().items()})
        found = seen.back(probability_of_rain(logits.numpy())) > model.spec.threshold
        total += Counts.of(found, card.rain_of(scan))
    return total


if __name__ == "__main__":
    main()
