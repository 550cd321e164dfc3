"""Shows every step from scans to a deployed model, on simulated rain.

First the model that comes with derain cleans two simulated scans, or with --scan scans of your own.
Then the command simulates rain in streets; trains 3D-OutDet, SalsaNext and LiSnowNet-L1 on the
scans, the last without labels; exports and proves each; cleans scans; and compares the networks
with filters, with the model that comes with derain, and with baselines that every method has to
beat.

  derain demo
  derain demo --out somewhere
  derain demo --scan scan.pcd
"""

import argparse
from pathlib import Path

from derain.cli.options import add_columns, count
from derain.cli.outputs import print_lines
from derain.sources.folders import named_frames
from derain.system.extras import EXPORT_LIBRARIES, OPEN3D, OPTUNA, TRAINING_LIBRARIES, require


def add_arguments(parser: argparse.ArgumentParser) -> None:
    """Declares the command's arguments."""
    parser.add_argument("--out", type=Path, default=Path("demo"), help="folder (default: demo)")
    parser.add_argument("--epochs", type=count, help="train for another number of epochs")
    parser.add_argument(
        "--scan", type=Path, help="scan of your own, or folder of scans, to begin with"
    )
    add_columns(parser, of="your ")


def main(arguments: argparse.Namespace) -> int:
    """Runs the command."""
    require("demo", *TRAINING_LIBRARIES, *EXPORT_LIBRARIES, OPTUNA, OPEN3D)
    out, epochs = arguments.out, arguments.epochs
    if arguments.scan is not None:
        named_frames([arguments.scan], arguments.columns)[0].read()  # refuses what cannot be read
    from derain.workflows.demo import DemoConfig, run_demo

    settings = {} if epochs is None else {"trainer.max_epochs": epochs}
    print(f"Simulated rain, from streets to a table. Everything goes to {out}/\n")
    config = DemoConfig(out, settings=settings, scan=arguments.scan, columns=arguments.columns)
    run_demo(config, print_lines)
    first = f"{config.given.name}/before_after.png"
    pictures = first, "before_after.png", "bench/speed_error.png"
    print_lines(f"Pictures in {out}: {', '.join(pictures)}")
    print_lines(f"Training: tensorboard --logdir {out / 'runs'}")
    return 0
