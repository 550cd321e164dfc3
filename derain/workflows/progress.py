"""Progress of long work: its steps, and the epochs of a training, with their times."""

import math
import sys
import time
from collections.abc import Callable

from lightning import LightningModule, Trainer
from lightning.pytorch.callbacks import Callback

# Receives the lines to show.
Show = Callable[[str], None]


def show_nothing(text: str) -> None:
    """Drops the lines."""


class Steps:
    """Shows steps and their results.

    Args:
        show: Receives each line.
        total: Number of all steps.
    """

    def __init__(self, show: Show, total: int) -> None:
        self.show = show
        self._total = total
        self._begun = 0
        self._start = self._step = time.monotonic()

    def begin(self, title: str) -> None:
        """Shows what the next step does, and how many steps there are."""
        self._begun += 1
        self.show(f"{title} (step {self._begun} of {self._total})")
        self._step = time.monotonic()

    def end(self, result: str) -> None:
        """Shows the result of the step, and its time."""
        self.show(f"  {clock(time.monotonic() - self._step)}  {result}")

    @property
    def elapsed(self) -> str:
        """Time since the first step, as minutes and seconds."""
        return clock(time.monotonic() - self._start)


def clock(seconds: float) -> str:
    """A time as minutes and seconds."""
    return f"{int(seconds) // 60}:{int(seconds) % 60:02d}"


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
        metrics = trainer.callback_metrics  # which all processes have to work out together
        if not trainer.is_global_zero:
            return
        epoch, last = trainer.current_epoch + 1, trainer.max_epochs
        elapsed = time.monotonic() - self._start
        of_all, times = "", clock(elapsed)
        if last is not None and last > 0:  # -1: until it is stopped
            of_all = f" of {last}"
            times += f", {clock(elapsed / (epoch - self._first) * (last - epoch))} left"
        iou = float(metrics.get("val_iou", math.nan))
        scored = "" if math.isnan(iou) else f"IoU {iou:.3f}; "
        print(f"epoch {epoch}{of_all}: {scored}{times}", file=sys.stderr, flush=True)
