"""TensorBoard's page of custom scalars: charts that answer a question each."""

from typing import Any

import lightning
from lightning.pytorch.loggers import TensorBoardLogger

from derain.models.callbacks.errors import BY_CLASS, LEFT_BY_RANGE, LOST_BY_RANGE
from derain.models.callbacks.step_times import SPEED, STEP

# Charts by question, each with regular expressions of the scalars in it. All lines of a run have
# one colour, and only their marks tell them apart: what is to be compared stands in one chart.
CHARTS = {
    "Is it learning?": {
        "loss in training": ["train/loss$"],
        "loss in validation": ["val/loss$"],
        "parts of the loss in training": ["train/(?!loss$)"],
        "validation: IoU": ["val/iou$"],
        "validation: precision": ["val/precision$"],
        "validation: recall": ["val/recall$"],
        "validation: average precision": ["val/average_precision$"],
    },
    "Where does it err?": {
        "share of each class that is judged wrongly": [f"{BY_CLASS}/"],
        "share of the rain that is left, by range": [f"{LEFT_BY_RANGE}/"],
        "share of all else that is lost, by range": [f"{LOST_BY_RANGE}/"],
    },
    "How fast is it?": {
        "milliseconds of a step": [f"{STEP}/"],
        "scans per second": [f"{SPEED}/"],
    },
}


class Dashboard(lightning.Callback):
    """Lays out the page at the start of a training."""

    def on_train_start(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Writes the layout, which TensorBoard keeps with the run."""
        for logger in trainer.loggers:
            if isinstance(logger, TensorBoardLogger):
                logger.experiment.add_custom_scalars(
                    {
                        question: {title: ["Multiline", tags] for title, tags in charts.items()}
                        for question, charts in CHARTS.items()
                    }
                )
