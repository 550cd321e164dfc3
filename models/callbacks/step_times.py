"""The speed of a training, and the time of the parts of its steps, in TensorBoard."""

import time
from typing import Any

import lightning
import torch

from derain.learning.batch import READ, VIEW, Batch, summed_times

# Groups of scalars: milliseconds of a step by what they are spent on, and scans a second.
STEP, SPEED = "milliseconds_per_step", "speed"
WAIT, NETWORK = "wait", "network"


class StepTimes(lightning.Callback):
    """Logs means over the steps since it last did, as often as the trainer logs.

    ``read`` and ``view`` are what the batch took to make, in workers or here; ``wait`` is how long
    the training waited for it, ``network`` the step itself. So a step takes ``wait`` and
    ``network``, and where workers keep up there is next to no ``wait``, however long they ``read``
    and ``view``. Scans a second are those of all processes together. Validation does not count, nor
    does the first step, for which the workers start.

    A graphics card computes while this process goes on. So of its steps the last before each log
    is the one whose ``network`` is timed, for which it is waited: to wait at each would slow all.
    """

    _spent: dict[str, float]  # milliseconds of the steps since the last log

    def on_train_start(self, *_: Any) -> None:
        """Resets the timing."""
        self._begin()
        self._started = False

    def on_train_epoch_start(self, *_: Any) -> None:
        """From here on, the first batch of the epoch is waited for."""
        self._waits_since: float | None = time.perf_counter()

    def on_validation_start(self, *_: Any) -> None:
        """Stops timing: the rest of this epoch does not wait for a batch."""
        self._waits_since = None

    def on_train_batch_start(
        self, trainer: lightning.Trainer, model: lightning.LightningModule, *_: Any
    ) -> None:
        """Takes the time that the batch was waited for."""
        came = time.perf_counter()
        self._asked = came if self._waits_since is None else self._waits_since
        self._waited = came - self._asked
        self._timed = self._due(trainer) or not _computes_meanwhile(model)
        self._stepped_since = self._now(model)

    def on_train_batch_end(
        self,
        trainer: lightning.Trainer,
        model: lightning.LightningModule,
        outputs: Any,
        batch: Batch,
        *_: Any,
    ) -> None:
        """Takes the time of the step, and logs where the trainer does."""
        self._waits_since = now = self._now(model)
        if not self._started:
            self._started = True
            return
        due = self._due(trainer)
        self._steps += 1
        self._scans += len(batch.cells)
        self._seconds += now - self._asked
        self._spent = summed_times([self._spent, batch.milliseconds, {WAIT: 1e3 * self._waited}])
        if self._timed:
            self._network.append(1e3 * (now - self._stepped_since))
        if due:
            self._log(trainer)

    def on_train_end(self, trainer: lightning.Trainer, *_: Any) -> None:
        """Logs what is left of a training that was too short to be logged before, or since."""
        if self._steps:
            self._log(trainer)

    def _begin(self) -> None:
        self._steps = self._scans = 0
        self._seconds = 0.0
        # Where all is kept from earlier epochs, nothing is read.
        self._spent = {READ: 0.0, VIEW: 0.0, WAIT: 0.0}
        self._network: list[float] = []

    def _due(self, trainer: lightning.Trainer) -> bool:
        every: int = trainer.log_every_n_steps  # type: ignore[attr-defined]
        return 0 < every <= self._steps + 1

    def _now(self, model: lightning.LightningModule) -> float:
        if self._timed and _computes_meanwhile(model):
            torch.cuda.synchronize(model.device)
        return time.perf_counter()

    def _log(self, trainer: lightning.Trainer) -> None:
        values = {f"{STEP}/{name}": spent / self._steps for name, spent in self._spent.items()}
        if self._network:
            values[f"{STEP}/{NETWORK}"] = sum(self._network) / len(self._network)
        values[f"{SPEED}/scans_per_second"] = self._scans * trainer.world_size / self._seconds
        for logger in trainer.loggers:
            logger.log_metrics(values, trainer.global_step)
        self._begin()


def _computes_meanwhile(model: lightning.LightningModule) -> bool:
    return model.device.type == "cuda"
