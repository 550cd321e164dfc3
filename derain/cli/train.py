"""``derain fit``, ``validate``, ``test`` and ``predict``: Lightning's own command line."""

import argparse
import warnings
from importlib import resources
from pathlib import Path
from typing import Any

import torch
from jsonargparse import DefaultHelpFormatter
from lightning.pytorch import Trainer
from lightning.pytorch.callbacks import LearningRateMonitor, ModelCheckpoint
from lightning.pytorch.cli import ArgsType, LightningArgumentParser, LightningCLI

from derain.cli.run_folder import WholeConfig, writing_to_the_run_folder
from derain.cores import usable_cores

# Imported so that a configuration may name them without their modules.
from derain.datamodules.base import ScanDataModule
from derain.datamodules.folder import Folder
from derain.datamodules.rehearse3d import Rehearse3D
from derain.datamodules.scan_check import ScanCheck
from derain.datamodules.simulated import Simulated
from derain.datamodules.wads import Wads
from derain.errors import InputError
from derain.models.base import MERIT, DerainingModule
from derain.models.checkpoint import load_model
from derain.models.lisnownet import LiSnowNet
from derain.models.outdet import OutDet
from derain.models.panels import ScanPanels
from derain.models.prediction import PredictionWriter
from derain.models.report import TestReport
from derain.models.salsanext import SalsaNext
from derain.models.whole_checkpoints import save_whole
from derain.open3d_import import make_open3d_loadable
from derain.workers import end_with_launcher

EXAMPLES = {
    "fit": """\
Trains a derainer. The best and the last checkpoint, the TensorBoard log and the configuration go
to runs/<name>/version_<n>.

  derain fit --config outdet_wads.yaml --data.root WADS
  derain fit --config outdet_wads.yaml --data.root WADS --trainer.logger.name my_run
  derain fit --config outdet_wads.yaml --data.root WADS --ckpt_path .../last.ckpt   (goes on)
  tensorboard --logdir runs
""",
    "validate": """\
Measures a checkpoint on the validation scans.

  derain validate --config outdet_wads.yaml --data.root WADS --ckpt_path outdet.ckpt
""",
    "test": """\
Measures a checkpoint on the test scans: scores by average, class and range.

  derain test --config outdet_wads.yaml --data.root WADS --ckpt_path outdet.ckpt
""",
    "predict": """\
Writes the labels that a checkpoint gives the test scans, which need none of their own.

  derain predict --config outdet_wads.yaml --data.root WADS --ckpt_path outdet.ckpt \\
      --predictions.folder labels
""",
}


# What `--ckpt_path` may be besides a file: checkpoints that Lightning looks for itself.
FOUND_BY_LIGHTNING = ("last", "hpc")


class ExamplesFormatter(argparse.RawDescriptionHelpFormatter, DefaultHelpFormatter):
    """Leaves the line breaks of the examples alone."""


__all__ = [
    "Folder",
    "LiSnowNet",
    "OutDet",
    "Rehearse3D",
    "SalsaNext",
    "Simulated",
    "Wads",
    "train",
]


class DerainCLI(LightningCLI):
    """Lightning's command line with the callbacks that every run of derain has."""

    def add_arguments_to_parser(self, parser: LightningArgumentParser) -> None:
        """Adds the callbacks; ``--checkpoint.monitor`` and so on change them."""
        parser.add_lightning_class_args(ModelCheckpoint, "checkpoint")
        parser.add_lightning_class_args(ModelCheckpoint, "last")
        parser.add_lightning_class_args(LearningRateMonitor, "learning_rate")
        parser.add_lightning_class_args(ScanPanels, "panels")
        parser.add_lightning_class_args(PredictionWriter, "predictions")
        parser.add_lightning_class_args(TestReport, "report")
        parser.add_lightning_class_args(ScanCheck, "scan_check")
        parser.set_defaults(
            {
                "checkpoint.monitor": MERIT,
                "checkpoint.mode": "max",
                "checkpoint.filename": "best",
                "checkpoint.enable_version_counter": False,
                # What `--ckpt_path` goes on from: the best epoch may lie far back.
                "last.filename": "last",
                "last.enable_version_counter": False,
            }
        )

    def parse_arguments(self, parser: LightningArgumentParser, args: ArgsType) -> None:
        """Refuses a checkpoint that is none of ours before Lightning reads it."""
        super().parse_arguments(parser, args)
        path = self.config[self.config.subcommand].get("ckpt_path")
        if path in (None, *FOUND_BY_LIGHTNING):
            return
        if "://" in str(path):  # Lightning would unpickle anything in it
            raise InputError(path, "is an address", "Download it and give the file.")
        load_model(Path(path))

    def instantiate_trainer(self, **kwargs: Any) -> Trainer:
        """Makes the trainer, which writes its checkpoints whole or not at all."""
        return save_whole(super().instantiate_trainer(**kwargs))

    def instantiate_classes(self) -> None:
        """Instantiates data, model and trainer; what they find wrong is not the parser's error."""
        try:
            super().instantiate_classes()
        except ValueError as error:
            if isinstance(error.__cause__, InputError):
                raise error.__cause__ from None
            raise


def train(arguments: list[str]) -> None:
    """Runs one of Lightning's subcommands.

    Args:
        arguments: The subcommand and its options; ``--config`` takes a file or the name of a
            packaged configuration.

    Raises:
        InputError: A configuration that does not exist, a folder that cannot be written, or what
            data and model raise.
    """
    make_open3d_loadable()  # TensorBoard is to start, and show what this run logs
    # Lightning means the mixing of both; arguments of the command line are all that we pass on.
    warnings.filterwarnings("ignore", message="LightningCLI's args parameter")
    # Lightning 2.6 uses a name that torch 2.13 deprecates.
    warnings.filterwarnings("ignore", message=".*LeafSpec")
    end_with_launcher()
    torch.set_num_threads(min(torch.get_num_threads(), usable_cores()))
    with writing_to_the_run_folder():
        DerainCLI(
            DerainingModule,
            ScanDataModule,
            subclass_mode_model=True,
            subclass_mode_data=True,
            seed_everything_default=0,
            auto_configure_optimizers=False,
            save_config_callback=WholeConfig,
            # Every run has a folder of its own; only one without a logger meets its last one.
            save_config_kwargs={"overwrite": True},
            parser_kwargs={
                "formatter_class": ExamplesFormatter,
                **{name: {"description": text} for name, text in EXAMPLES.items()},
            },
            args=with_packaged_configs(arguments),
        )


def packaged_configs() -> dict[str, Path]:
    """Files of the configurations that come with derain, by file name."""
    folder = Path(str(resources.files("derain.configs")))
    return {file.name: file for file in sorted(folder.glob("*.yaml"))}


def with_packaged_configs(arguments: list[str]) -> list[str]:
    """Replaces the name of a packaged configuration by its file.

    Raises:
        InputError: A name that is neither a file nor packaged.
    """
    return [
        _config(argument.removeprefix("--config="), "--config=")
        if argument.startswith("--config=")
        else _config(argument)
        if previous in ("--config", "-c")
        else argument
        for previous, argument in zip(["", *arguments], arguments, strict=False)
    ]


def _config(name: str, prefix: str = "") -> str:
    packaged = packaged_configs()
    if Path(name).is_file():
        return prefix + name
    if name in packaged:
        return prefix + str(packaged[name])
    raise InputError(name, "no such configuration", f"Packaged are {', '.join(packaged)}.")
