r"""Makes a checkpoint of derain from published weights.

  derain import-weights outdet saved_models/bin_desnow_wads/outdet.pt --stats wads --out outdet.ckpt
  derain import-weights outdet rehearse3d_outdet.pt --stats wads --data rehearse3d --out outdet.ckpt
  derain import-weights salsanext SalsaNext_valid_best --stats semantickitti --data rehearse3d \
      --grid rehearse3d --out salsanext.ckpt

--data names the data card of the training data, with their classes, rain and licence; --stats names
the card whose mean and standard deviation normalised the network's input. Each is a
packaged card or a YAML file. The published REHEARSE-3D weights of 3D-OutDet fit the statistics of
WADS best (inferred); those of SalsaNext were trained with SemanticKITTI's. --grid names the grid of
the range images that the weights were trained on.
"""

import argparse
from dataclasses import replace
from pathlib import Path

from derain.cli.options import file_named
from derain.cli.outputs import print_lines
from derain.errors import InputError, did_you_mean
from derain.system.extras import CHECKPOINT_LIBRARIES, require
from derain.views.spherical_grid import PUBLISHED_GRIDS


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("network", help="network of the weights, such as outdet")
    parser.add_argument("weights", type=Path, help="the published state_dict or checkpoint")
    parser.add_argument(
        "--stats",
        required=True,
        help="data card with their mean and std: wads, kitti, semantickitti, spray, or a YAML file",
    )
    parser.add_argument("--data", help="data card of the training data (default: that of --stats)")
    parser.add_argument(
        "--grid", choices=PUBLISHED_GRIDS, help="grid of the range image, if the network uses one"
    )
    parser.add_argument(
        "--out", type=file_named(".ckpt"), required=True, help="the checkpoint to write"
    )


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("import-weights", *CHECKPOINT_LIBRARIES)
    from derain.cards.card import load_card
    from derain.models.checkpoint import save_model
    from derain.models.published import Published, read_state_dict
    from derain.models.registry import NETWORKS
    from derain.sources.training_record import record_of_sequences

    name = arguments.network
    published = {known: kind for known, kind in NETWORKS.items() if issubclass(kind, Published)}
    if name not in published:
        reason = "no weights of it were published" if name in NETWORKS else "no such network"
        known = f"{did_you_mean(name, published)}Available: {', '.join(published)}."
        raise InputError(name, reason, known)
    stats = load_card(arguments.stats)
    data = stats if arguments.data is None else load_card(arguments.data)
    if not data.rain:
        reason = f"{data.name} has no rain"
        raise InputError("--data", reason, "Give the card of the weights' training data.")
    weights = read_state_dict(arguments.weights)
    try:
        model = published[name].from_published(weights, data.normalised_as(stats), arguments.grid)
    except InputError as error:
        if str(error.subject).startswith("--") or error.subject == data.name:
            raise  # of an option or the card: not of the file
        raise InputError(arguments.weights, error.reason, error.remedy) from error
    model.adopt(replace(model.spec, training=record_of_sequences(data.split.get("train", ()))))
    save_model(model, arguments.out)
    print_lines(
        f"Wrote {arguments.out}: {model.NAME} trained on {data.name}, "
        f"with the statistics of {stats.name}"
    )
    return 0
