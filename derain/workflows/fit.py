"""Trains a network from a packaged configuration or one of your own."""

import json
import math
from collections.abc import Mapping
from contextlib import nullcontext
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from derain.errors import InputError
from derain.workflows.progress import EpochLines
from derain.workflows.training import checkpoint_of_run, quiet_lightning, run_trainer


@dataclass(frozen=True)
class FitResults:
    """A finished training.

    Attributes:
        checkpoint: The best checkpoint, or the last where no validation chose one; None where none
            was saved.
        folder: Folder of the logs and the configuration; None without a logger.
        metrics: Values that the last epoch logged, by name.
    """

    checkpoint: Path | None
    folder: Path | None
    metrics: Mapping[str, float]

    @property
    def iou(self) -> float | None:
        """IoU of rain on the validation scans after the last epoch; None where it is undefined."""
        iou = self.metrics.get("val_iou", math.nan)
        return None if math.isnan(iou) else iou


def fit(
    config: str | Path | None = None,
    settings: Mapping[str, Any] | None = None,
    quiet: bool = False,
) -> FitResults:
    """Trains a network, as ``derain fit`` does.

    Example:
        >>> settings = {"data.root": "taught", "trainer.max_epochs": 3}
        >>> results = fit("outdet_taught.yaml", settings)  # doctest: +SKIP
        >>> results.checkpoint, results.iou  # doctest: +SKIP
        (PosixPath('runs/outdet_taught/version_0/checkpoints/best.ckpt'), 0.93)
        >>> " ".join(fit_options("outdet_taught.yaml", settings))
        '--config outdet_taught.yaml --data.root taught --trainer.max_epochs 3'

    Args:
        config: A YAML file, or the name of a packaged configuration; None where the settings are
            the whole configuration.
        settings: Values of the options of ``derain fit``, by name: ``{"data.root": "WADS",
            "trainer.max_epochs": 5}``. They replace those of the configuration.
        quiet: True if a line for each epoch stands for all that Lightning prints.

    Raises:
        InputError: A configuration, option or checkpoint that cannot be used, a folder that cannot
            be written, or data that cannot be read.
    """
    options = fit_options(config, settings or {})
    defaults = {"enable_progress_bar": False, "callbacks": [EpochLines()]} if quiet else {}
    with quiet_lightning() if quiet else nullcontext():
        trainer = run_trainer(["fit", *options], trainer=defaults).trainer
    return FitResults(
        checkpoint_of_run(trainer),
        Path(trainer.log_dir) if trainer.loggers and trainer.log_dir else None,
        {name: float(value) for name, value in trainer.callback_metrics.items()},
    )


def fit_options(config: str | Path | None, settings: Mapping[str, Any]) -> list[str]:
    """The options of ``derain fit`` that do the same as :func:`fit`.

    Args:
        config: As for :func:`fit`.
        settings: As for :func:`fit`.

    Raises:
        InputError: A setting of another type than options can have.
    """
    words = [] if config is None else ["--config", str(config)]
    for name, value in settings.items():
        text = str(value) if isinstance(value, str | Path) else json.dumps(value, default=_listed)
        words += [f"--{name}", text]
    return words


def _listed(value: Any) -> Any:
    """A path in a list, or a number or an array of NumPy, as JSON takes it."""
    if isinstance(value, Path):
        return str(value)
    if isinstance(value, np.generic | np.ndarray):
        return value.tolist()
    reason = f"one cannot be of type {type(value).__name__}"
    raise InputError("settings", reason, "Give texts, numbers, paths or lists of these.")
