"""Training and measuring networks by Lightning's Trainer, from configurations and options."""

import argparse
import logging
import os
import shutil
import warnings
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import torch
from jsonargparse import DefaultHelpFormatter, Namespace
from lightning.pytorch import LightningModule, Trainer
from lightning.pytorch.callbacks import LearningRateMonitor, ModelCheckpoint
from lightning.pytorch.cli import LightningArgumentParser, LightningCLI, SaveConfigCallback
from lightning.pytorch.loggers import TensorBoardLogger
from torch.distributed import is_torchelastic_launched

# Imported so that a configuration may name them without their modules.
from derain.datamodules.base import ScanDataModule
from derain.datamodules.folder import Folder
from derain.datamodules.mixture import Mixture
from derain.datamodules.rehearse3d import Rehearse3D
from derain.datamodules.scan_check import ScanCheck
from derain.datamodules.sequences import Sequences
from derain.datamodules.simulated import Simulated
from derain.datamodules.taught import Taught
from derain.datamodules.wads import Wads
from derain.datamodules.worlds import Worlds
from derain.errors import InputError, reason_of
from derain.files.atomic import replacing
from derain.files.documents import Entry
from derain.learning.start import START_HELP, checkpoint_of
from derain.models.base import DerainingModule
from derain.models.callbacks.best_checkpoint import BestCheckpoint
from derain.models.callbacks.panels import Panels
from derain.models.callbacks.prediction import PredictionWriter
from derain.models.callbacks.report import TestReport
from derain.models.callbacks.step_times import StepTimes
from derain.models.checkpoint import (
    check_resumable,
    class_path,
    load_model,
    network_of_checkpoint,
    save_whole,
    started,
)
from derain.models.limits import check_hyperparameters
from derain.models.measured import MONITOR
from derain.models.registry import NETWORKS
from derain.system.cores import usable_cores
from derain.system.memory import KEPT_IN_TRAINING, keep_freed_memory
from derain.system.open3d_import import warn_where_tensorboard_cannot_start
from derain.system.workers import exit_with_launcher
from derain.workflows.configurations import with_packaged_configs
from derain.workflows.training_errors import (
    as_input_error,
    known_options,
    raised_by_lightning,
    refusals_in_a_line,
)

# What `--ckpt_path` may be besides a file: checkpoints that Lightning looks for itself.
FOUND_BY_LIGHTNING = ("last", "hpc")

# The logger of messages that one process of several writes, and those above all of Lightning's.
MESSAGES = logging.getLogger("lightning.pytorch.utilities.rank_zero")
LOGGERS = ("lightning.pytorch", "lightning.fabric")

# No seed of a random generator is larger.
LARGEST_SEED = 2**32 - 1

# The least of numbers that torch, Lightning and the callbacks take as they are.
LEAST = {
    "seed_everything": 0,
    "trainer.accumulate_grad_batches": 1,
    "trainer.check_val_every_n_epoch": 1,
    "trainer.log_every_n_steps": 0,
    "panels.scans": 0,
    "scan_check.scans": 0,
}

# Precisions in which the weights stay float32. Lightning converts no batch of derain's to another.
PRECISIONS = ("32", "32-true", "16", "16-mixed", "bf16", "bf16-mixed")

# Where a training's folder has its checkpoints, and its configuration.
CHECKPOINTS, CONFIGURATION = "checkpoints", "config.yaml"


class ExamplesFormatter(argparse.RawDescriptionHelpFormatter, DefaultHelpFormatter):
    """Leaves the line breaks of the examples alone."""


def choices() -> dict[str, tuple[type, ...]]:
    """Classes with options of their own, by the option that chooses them.

    They are loaded then, and a configuration may name their classes without a module.
    """
    return {
        "data": (Folder, Mixture, Rehearse3D, Sequences, Simulated, Taught, Wads, Worlds),
        "model": tuple(NETWORKS.values()),
        "trainer.logger": (TensorBoardLogger,),
    }


class DerainCLI(LightningCLI):
    """Lightning's command line for one method of the trainer, with the callbacks of every run.

    Args:
        method: ``fit``, ``validate``, ``test`` or ``predict``. The options of the others, which
            take time to prepare, are left out.
        options: The arguments of :class:`LightningCLI`.
    """

    def __init__(self, method: str, **options: Any) -> None:
        self._method = method
        super().__init__(DerainingModule, ScanDataModule, **options)

    def subcommands(self) -> dict[str, set[str]]:
        """The method, and those of its arguments that are no options."""
        return {self._method: super().subcommands()[self._method]}

    def add_arguments_to_parser(self, parser: LightningArgumentParser) -> None:
        """Adds the callbacks; ``--checkpoint.monitor`` and so on change them."""
        parser.add_argument("--start", type=str | None, default=None, help=START_HELP)
        parser.add_lightning_class_args(BestCheckpoint, "checkpoint")
        parser.add_lightning_class_args(ModelCheckpoint, "last")
        parser.add_lightning_class_args(LearningRateMonitor, "learning_rate")
        parser.add_lightning_class_args(Panels, "panels")
        parser.add_lightning_class_args(StepTimes, "step_times")
        parser.add_lightning_class_args(PredictionWriter, "predictions")
        parser.add_lightning_class_args(TestReport, "report")
        parser.add_lightning_class_args(ScanCheck, "scan_check")
        parser.set_defaults(
            {
                "checkpoint.monitor": MONITOR,
                "checkpoint.mode": "max",
                "checkpoint.filename": "best",
                "checkpoint.enable_version_counter": False,
                # What `--ckpt_path` goes on from: the best epoch may lie far back.
                "last.filename": "last",
                "last.enable_version_counter": False,
            }
        )

    def parse_arguments(self, parser: LightningArgumentParser, args: list[str]) -> None:
        """Refuses what cannot be used: options, and checkpoints before Lightning reads them."""
        if self._method == "test":
            parser.set_defaults({"test.verbose": False})  # the table is in our report
        classes = choices()  # loaded first: a configuration may name them without their modules
        try:
            super().parse_arguments(parser, args)
        except argparse.ArgumentError as error:
            known = known_options(self._subcommand_parsers[self._method], classes)
            raise as_input_error(error.message, known, classes) from error
        self._check_options()
        path = self.config[self.config.subcommand].get("ckpt_path")
        if path in (None, *FOUND_BY_LIGHTNING):
            return
        if "://" in str(path):  # Lightning would unpickle anything in it
            raise InputError(path, "is an address", "Download it and give the file.")
        check = check_resumable if self.config.subcommand == "fit" else load_model
        check(Path(path))
        if self.config.subcommand == "test":
            self._log_beside(Path(path), args)

    def _parse_ckpt_path(self) -> None:
        """Takes the model's class and arguments from the checkpoint, as Lightning does.

        Lightning would import whatever class the file names; here it is that of the registry.

        Raises:
            InputError: A training is to go on from a checkpoint of another network.
        """
        config = self.config[self.config.subcommand]
        path = config.get("ckpt_path")
        if path not in (None, *FOUND_BY_LIGHTNING):
            network, arguments = network_of_checkpoint(Path(path))
            chosen = config.model.class_path.rpartition(".")[2]
            if self._method == "fit" and chosen != network.__name__:
                raise InputError(
                    path,
                    f"a checkpoint of {network.__name__}, from which no {chosen} can go on",
                    "Resume with the configuration of its training.",
                )
            model = {"class_path": class_path(network), "dict_kwargs": arguments}
            try:
                self.config = self.parser.parse_object(
                    {self.config.subcommand: {"model": model}}, self.config
                )
            except argparse.ArgumentError as error:
                raise InputError(path, reason_of(error), "Give a checkpoint of derain.") from error

    def _check_options(self) -> None:
        """Refuses values of options that torch or Lightning would stumble over later."""
        config = self.config[self.config.subcommand]
        for option, least in LEAST.items():
            value = config.get(option)
            if isinstance(value, int) and not isinstance(value, bool):  # a seed may be
                Entry(f"--{option}", "", value).whole(least, LARGEST_SEED)
        precision = config.get("trainer.precision")
        if precision is not None and str(precision) not in PRECISIONS:
            raise InputError(
                "--trainer.precision",
                f"the weights cannot be {precision}",
                f"Choose one of {', '.join(PRECISIONS)}.",
            )
        arguments = config.model.get("init_args") or {}
        check_hyperparameters(
            {name: Entry(f"--model.{name}", "", value) for name, value in arguments.items()}
        )

    def _log_beside(self, checkpoint: Path, arguments: list[str]) -> None:
        """Logs a test into the folder of its training, unless an option names another logger."""
        chosen = any(argument.startswith("--trainer.logger") for argument in arguments)
        folder = checkpoint.resolve().parent
        run, logger = folder.parent, self.config.test.trainer.logger
        of_training = folder.name == CHECKPOINTS and (run / CONFIGURATION).is_file()
        if chosen or not of_training or not isinstance(logger, Namespace):
            return
        if logger.class_path.endswith(TensorBoardLogger.__name__):
            place = {"save_dir": str(run.parent), "name": "", "version": run.name}
            for name, value in place.items():
                logger.init_args[name] = value

    def instantiate_trainer(self, **kwargs: Any) -> Trainer:
        """Makes the trainer, which writes its checkpoints whole or not at all."""
        trainer = save_whole(super().instantiate_trainer(**processes_of_torchrun(), **kwargs))
        if not trainer.loggers:  # the monitor refuses to train without one
            callbacks = trainer.callbacks  # type: ignore[attr-defined]
            callbacks[:] = [each for each in callbacks if not isinstance(each, LearningRateMonitor)]
        return trainer

    def instantiate_classes(self) -> None:
        """Instantiates data, model and trainer; what they find wrong is not the parser's error."""
        try:
            super().instantiate_classes()
        except ValueError as error:
            if isinstance(error.__cause__, InputError):
                raise error.__cause__ from None
            raise
        start = self.config[self.config.subcommand].get("start")
        if start is not None and self.config.subcommand == "fit":
            self.model = started(self.model, checkpoint_of(start), start)


def processes_of_torchrun() -> dict[str, int]:
    """The trainer's machines and devices where torchrun started this process; otherwise nothing.

    Lightning's own default is one machine: every process would train alone, and write its own run.
    """
    if not is_torchelastic_launched():
        return {}
    machines, processes = os.environ["GROUP_WORLD_SIZE"], os.environ["LOCAL_WORLD_SIZE"]
    return {"num_nodes": int(machines), "devices": int(processes)}


class WholeConfig(SaveConfigCallback):
    """Writes the configuration of a run as ``config.yaml``, whole or not at all.

    That of a test, which writes into the folder of the training, goes beside it, as ``test.yaml``.
    """

    def setup(self, trainer: Trainer, pl_module: LightningModule, stage: str) -> None:
        """Writes it where the run's log goes, once; without a log it is not written."""
        if not trainer.loggers:  # the folder is the current one, whose files are the user's
            return
        folder = trainer.log_dir  # every process reads it: the first sends it to the others
        if folder is None or "://" in folder:
            super().setup(trainer, pl_module, stage)
        elif trainer.is_global_zero and not self.already_saved:
            name = "test.yaml" if stage == "test" else self.config_filename
            with replacing(Path(folder) / name) as temporary:
                self.parser.save(self.config, temporary, skip_unset=False, overwrite=True)
            self.already_saved = True

    def on_exception(
        self, trainer: Trainer, pl_module: LightningModule, exception: BaseException
    ) -> None:
        """Removes the folder of a run that is refused before its first step: it holds no result."""
        logger = trainer.logger
        if trainer.global_step or not isinstance(logger, TensorBoardLogger):
            return
        refused = isinstance(exception, InputError) or raised_by_lightning(exception)
        if trainer.is_global_zero and refused:
            folder = Path(logger.log_dir)
            names = sorted(path.name.split(".")[0] for path in folder.glob("*"))
            # The arguments come last, and there is nothing of an earlier run.
            if names in (["config", "events"], ["config", "events", "hparams"]):
                shutil.rmtree(folder)
                with suppress(OSError):  # other runs of the name are in it
                    folder.parent.rmdir()


def run_trainer(
    arguments: Sequence[str],
    description: str | None = None,
    trainer: Mapping[str, Any] | None = None,
) -> DerainCLI:
    """Makes model, data and trainer from options, and runs one of the trainer's methods.

    Args:
        arguments: ``fit``, ``validate``, ``test`` or ``predict``, and its options; ``--config``
            takes a file or the name of a packaged configuration.
        description: Text above the list of all options.
        trainer: Defaults of the trainer, and callbacks besides those that every run has.

    Returns:
        The trainer, the model and the data module, with their configuration.

    Raises:
        InputError: A configuration that does not exist, a folder that cannot be written, or what
            data and model raise.
    """
    method = arguments[0]
    _prepare_process(method)
    of_parsers = {
        "formatter_class": ExamplesFormatter,
        "allow_abbrev": False,  # a misspelling is no abbreviation
        "exit_on_error": False,  # faults become InputErrors
    }
    with refusals_in_a_line():
        return DerainCLI(
            method,
            subclass_mode_model=True,
            subclass_mode_data=True,
            seed_everything_default=0,
            auto_configure_optimizers=False,
            save_config_callback=WholeConfig,
            # A run whose version is stated meets the last one of it.
            save_config_kwargs={"overwrite": True},
            trainer_defaults={"enable_model_summary": False, **(trainer or {})},
            parser_kwargs={**of_parsers, method: {**of_parsers, "description": description}},
            args=with_packaged_configs(arguments),
        )


def checkpoint_of_run(trainer: Trainer) -> Path | None:
    """The best checkpoint of a run, or its last where no validation chose one; None without any."""
    callbacks = trainer.checkpoint_callbacks  # the best one's first
    paths = [each.best_model_path for each in callbacks if isinstance(each, ModelCheckpoint)]
    return next((Path(path) for path in paths if path), None)


@contextmanager
def quiet_lightning() -> Iterator[None]:
    """Hides Lightning's messages and advice, such as what hardware it found, in the block."""
    levels = {logger: logger.level for logger in map(logging.getLogger, LOGGERS)}
    try:
        for logger in levels:
            logger.setLevel(logging.WARNING)
        with warnings.catch_warnings():
            warnings.filterwarnings("ignore", module=r"lightning\.")
            yield
    finally:
        for logger, level in levels.items():
            logger.setLevel(level)


def _prepare_process(method: str) -> None:
    """Sets what holds for the whole process: messages, threads and memory."""
    MESSAGES.addFilter(lambda record: "Tip: " not in record.getMessage())  # of what to install
    if method == "fit":
        warn_where_tensorboard_cannot_start()
    # Lightning warns where sys.argv has options too; the arguments alone are used.
    warnings.filterwarnings("ignore", message="LightningCLI's args parameter")
    # Lightning 2.6 uses a name that torch 2.13 deprecates.
    warnings.filterwarnings("ignore", message=".*LeafSpec")
    # The last checkpoint has nothing to lose by it, and of the best one BestCheckpoint takes care.
    warnings.filterwarnings("ignore", message="The dirpath has changed")
    exit_with_launcher()
    torch.set_num_threads(min(torch.get_num_threads(), usable_cores()))
    keep_freed_memory(KEPT_IN_TRAINING)
    # Deterministic training would write to every new array before anything computes it.
    torch.utils.deterministic.fill_uninitialized_memory = False  # type: ignore[attr-defined]
