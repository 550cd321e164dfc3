"""Which epochs of a training are drawn, so that its log does not grow with every one."""

import lightning
import numpy as np
from lightning.pytorch.trainer.states import TrainerFn


class DrawnEpochs:
    """Chooses some of the epochs that end in a validation, spread from the first to the last.

    Where nobody says how many epochs there are, each chosen one comes after twice as many
    validations as the one before it. Of an epoch with several validations, the first is drawn.

    Args:
        pictures: How many epochs are drawn in a training whose length is known.
    """

    def __init__(self, pictures: int) -> None:
        self.pictures = pictures
        self.last: int | None = None

    def begins(self, trainer: lightning.Trainer) -> bool:
        """Whether what is measured now is drawn: asked once, when a validation or test begins."""
        if trainer.sanity_checking or not self.pictures:
            return False
        if trainer.state.fn != TrainerFn.FITTING:
            return True
        if trainer.current_epoch == self.last or not self._chosen(trainer):
            return False
        self.last = trainer.current_epoch
        return True

    def _chosen(self, trainer: lightning.Trainer) -> bool:
        epochs = trainer.max_epochs
        every = trainer.check_val_every_n_epoch or 1
        validation = (trainer.current_epoch + 1) // every
        if epochs is None or epochs < 1:
            return validation & (validation - 1) == 0  # a power of two
        return validation - 1 in np.linspace(0, epochs // every - 1, self.pictures).round()
