"""The folder that a training run writes to: its configuration, and what is said if it cannot be."""

import errno
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path

import lightning
from lightning.pytorch.cli import SaveConfigCallback

from derain.errors import InputError
from derain.files.atomic import replacing

# What the system answers where a file cannot be written. Lightning raises some errors of its own
# as the system's, for other reasons and without a number.
REFUSALS = (
    *(errno.EACCES, errno.EPERM, errno.EROFS, errno.ENOENT, errno.ENOTDIR, errno.EEXIST),
    *(errno.ENOSPC, errno.EDQUOT, errno.EFBIG, errno.EIO, errno.ENAMETOOLONG),
)

# Where a training's folder has its checkpoints, and its configuration.
CHECKPOINTS, CONFIGURATION = "checkpoints", "config.yaml"


class WholeConfig(SaveConfigCallback):
    """Writes the configuration of a run as ``config.yaml``, whole or not at all.

    That of a test, which writes into the folder of the training, goes beside it, as ``test.yaml``.
    """

    def setup(
        self, trainer: lightning.Trainer, pl_module: lightning.LightningModule, stage: str
    ) -> None:
        """Writes it where the run's log goes, once."""
        folder = trainer.log_dir  # asked by every process: the first tells it to the others
        if folder is None or "://" in folder:
            super().setup(trainer, pl_module, stage)
        elif trainer.is_global_zero and not self.already_saved:
            name = "test.yaml" if stage == "test" else self.config_filename
            with replacing(Path(folder) / name) as temporary:
                self.parser.save(self.config, temporary, skip_none=False, overwrite=True)
            self.already_saved = True


def folder_of_run(checkpoint: Path) -> Path | None:
    """The folder of the training that a checkpoint was saved in; None where it lies elsewhere."""
    folder = checkpoint.resolve().parent.parent
    saved = checkpoint.resolve().parent.name == CHECKPOINTS
    return folder if saved and (folder / CONFIGURATION).is_file() else None


@contextmanager
def logging_to_run_folder() -> Iterator[None]:
    """Turns the system's refusal to write into an error that a user can act on."""
    try:
        yield
    except OSError as error:
        # A logger that cannot write either when it is closed hides what it was closed for.
        earlier: BaseException | None = error
        while earlier is not None:
            if isinstance(earlier, InputError):
                raise earlier from None
            earlier = earlier.__context__
        if error.errno not in REFUSALS:
            raise
        raise InputError(
            error.filename or "the run's folder",
            f"cannot be written ({error.strerror})",
            "Choose a folder that is writable and has room: --trainer.logger.save_dir.",
        ) from error
