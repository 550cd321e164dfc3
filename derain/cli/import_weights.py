"""``derain import-weights``: a checkpoint of derain from weights that others published."""

import argparse
from pathlib import Path

from derain.cli.outputs import say

SUMMARY = "make a checkpoint from published weights"

DESCRIPTION = """\
Makes a checkpoint of derain from published weights.

  derain import-weights outdet saved_models/bin_desnow_wads/outdet.pt --stats wads --out outdet.ckpt
  derain import-weights outdet rehearse3d_outdet.pt --stats wads --out outdet.ckpt
  derain import-weights salsanext SalsaNext_valid_best --stats kitti --grid rehearse3d \
      --out salsanext.ckpt

--stats names the data card whose mean and standard deviation the weights were trained with: a
packaged one or a YAML file. The published REHEARSE-3D weights of 3D-OutDet fit those of WADS best
(inferred); those of SalsaNext were trained with SemanticKITTI's. --grid names the grid of the range
images that the weights were trained on.
"""


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("network", help="outdet, salsanext or lisnownet")
    parser.add_argument("weights", type=Path, help="the published state_dict or checkpoint")
    parser.add_argument(
        "--stats", required=True, help="data card: wads, kitti, spray, or a YAML file"
    )
    parser.add_argument(
        "--grid", help="of a range image: semantickitti, rehearse3d or wads (not for outdet)"
    )
    parser.add_argument("--out", type=Path, required=True, help="the checkpoint to write")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    from derain.cards import load_card
    from derain.errors import InputError
    from derain.models.checkpoint import MODELS, save_model
    from derain.models.published import read_state_dict

    if arguments.network not in MODELS:
        raise InputError(arguments.network, "no such network", f"Known are {', '.join(MODELS)}.")
    model = MODELS[arguments.network].from_published(
        read_state_dict(arguments.weights), load_card(arguments.stats), arguments.grid
    )
    save_model(model, arguments.out)
    say(f"Wrote {arguments.out}: {model.NAME} with the statistics of {model.spec.data}")
    return 0
