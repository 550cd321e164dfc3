"""A run's row in TensorBoard's table of hyper-parameters."""

from collections.abc import Iterable, Mapping
from typing import Any

from lightning.pytorch.loggers import TensorBoardLogger
from torch.utils.tensorboard.summary import hparams

from derain.evaluation.counts import SCORES

# By what the table ranks runs: the IoU of the latest validation, and the scores of the test.
COLUMNS = ("hp_metric", *(f"test/{score}" for score in reversed(SCORES)), "test/average_precision")


def log_hyperparameters(loggers: Iterable[object], parameters: Mapping[str, Any]) -> None:
    """Enters a run. What is not logged yet stays blank in the table, a test above all.

    Args:
        loggers: The run's; those of TensorBoard are written to.
        parameters: What is to stand in the table. The Spec, which is as long as a page, and names
            that begin with an underscore are left out.
    """
    shown = {
        name: value if isinstance(value, bool | int | float | str) else _as_text(value)
        for name, value in parameters.items()
        if name != "spec" and not name.startswith("_")
    }
    for logger in loggers:
        # TensorBoard takes the columns of all runs from one of them, so that each must name those
        # of the test, too. Lightning would log a score of 0 for each column, which nobody measured.
        writer: Any = logger.experiment.file_writer if isinstance(logger, TensorBoardLogger) else 0
        if hasattr(writer, "add_summary"):  # as of the first process
            for summary in hparams(shown, dict.fromkeys(COLUMNS, 0.0)):
                writer.add_summary(summary)


def _as_text(value: Any) -> str:
    if isinstance(value, tuple | list):
        return ", ".join(map(str, value))
    return str(value)
