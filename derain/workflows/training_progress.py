"""How far a training is, how good, and how long it still takes."""

import math
import sys
import time

from lightning import LightningModule, Trainer
from lightning.pytorch.callbacks import Callback

from derain.workflows.steps import clock


class EpochLines(Callback):
    """Prints a line on stderr after each epoch: ``epoch 3 of 20: IoU 0.812; 1:12, 6:48 left``.

    The IoU is that of rain on the validation scans, left out where it is undefined. The time left
    is that of the epochs to come, if each takes as long as those so far.
    """

    def on_train_start(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Starts the clock."""
        self._start = time.monotonic()
        self._first = trainer.current_epoch

    def on_train_epoch_end(self, trainer: Trainer, pl_module: LightningModule) -> None:
        """Prints the line, in one process of several."""
        if not trainer.is_global_zero:
            return
        epoch, last = trainer.current_epoch + 1, trainer.max_epochs
        elapsed = time.monotonic() - self._start
        of_all, times = "", clock(elapsed)
        if last is not None and last > 0:  # -1: until it is stopped
            of_all = f" of {last}"
            times += f", {clock(elapsed / (epoch - self._first) * (last - epoch))} left"
        iou = float(trainer.callback_metrics.get("val_iou", math.nan))
        scored = "" if math.isnan(iou) else f"IoU {iou:.3f}; "
        print(f"epoch {epoch}{of_all}: {scored}{times}", file=sys.stderr, flush=True)
